// SPDX-License-Identifier: BSD-3-Clause
// The inner loop of the association, in vector code.
#pragma once

#include <algorithm>
#include <cstdint>

namespace riftmap {

/// Standard deviations that still match.
inline constexpr float kNoiseGate = 4.0F;

/// What a difference in depth counts beside one across the ray. Little: a vertex chosen because its
/// noise agrees with the pixel's would keep its noise.
inline constexpr float kDepthShare = 0.125F;

/// How far from a pixel's point a vertex may lie and still be the same surface: never below what
/// the noise and the sampling at that depth blur anyway.
struct Gate {
    float lateral = 0;  ///< across the ray [m]
    float depth = 0;    ///< along the ray, for an exactly known vertex [m]
};
inline constexpr float kBlur = 0.75F;  ///< of the spacing
inline Gate gateOf(float gamma, float spacing, float sigma, float stretch) {
    const float blur = kBlur * spacing;
    return {std::max(gamma, blur),
            std::max({gamma, kNoiseGate * sigma, blur * std::max(1.0F, stretch)})};
}

/// What matching needs to know of a vertex in view.
struct MatchEntry {
    float u, v, z;           ///< column, row [px], depth [m]
    float noise;             ///< (kNoiseGate sigma)^2 [m^2]
    std::int32_t candidate;  ///< its number
};

/// One row of pixels to match. The entries lie in the order of pixels: those of column c in row r
/// are [start[i], start[i + 1]) with i = r (width + 1) + c.
struct MatchRow {
    const MatchEntry* entries = nullptr;
    const std::uint32_t* start = nullptr;  ///< of the whole image
    int width = 0, height = 0, row = 0;
    float footprint = 0, gamma = 0;
    const float *depth = nullptr, *sigma = nullptr, *stretch = nullptr;  ///< of the row's pixels
    float* distance = nullptr;      ///< result: squared, in gates
    std::int32_t* found = nullptr;  ///< result: candidate or -1
};

/// For each pixel with depth > 0 the candidate within its gate with the least
///     (lateral / gate)^2 + kDepthShare (along the ray / gate)^2,
/// the smallest candidate among equals. The same on every machine.
void matchRow(const MatchRow& row);

}  // namespace riftmap
