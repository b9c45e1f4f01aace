// SPDX-License-Identifier: BSD-3-Clause
// Numbers of the map in few bits. All encodings are monotone, so that they compare as codes.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace riftmap::compact {

/// A positive number as a small float: 5 bits of exponent from 2^-kBelow up, the rest mantissa.
/// 0 and smaller than the range give code 0, larger the last code. Relative error 2^-(mantissa+1).
template <int kMantissa, int kBelow>
struct SmallFloat {
    static constexpr int kShift = 23 - kMantissa;
    static constexpr std::int32_t kBias = (127 - kBelow) << kMantissa;
    static constexpr std::int32_t kMax = (32 << kMantissa) - 1;

    static std::uint16_t encode(float value) {
        if (!(value > 0.0F)) {
            return 0;
        }
        const auto bits = std::bit_cast<std::int32_t>(value);
        const std::int32_t code = ((bits + (1 << (kShift - 1))) >> kShift) - kBias;
        return static_cast<std::uint16_t>(std::clamp(code, 0, kMax));
    }
    static float decode(std::uint16_t code) {
        return code == 0 ? 0.0F : std::bit_cast<float>((std::int32_t{code} + kBias) << kShift);
    }
};

/// Weight of an edge [m], 1 um to 4 km in 15 bits; the 16th says that the edge is high.
using Weight = SmallFloat<10, 20>;
inline constexpr std::uint16_t kHighBit = 0x8000;
/// Standard deviation [m], 1 um to 4 km in 16 bits.
using Sigma = SmallFloat<11, 20>;
/// Share of the surface [m^2], 2e-10 to 1 in 16 bits.
using Area = SmallFloat<11, 32>;
/// The same as a whole number of 2^-43 m^2, exactly: sums do not depend on their order.
inline std::int64_t areaUnits(std::uint16_t code) {
    return code == 0 ? 0 : std::int64_t{0x800 | (code & 0x7FF)} << (code >> 11U);
}
inline constexpr double kAreaUnitsPerSquareMetre = 8796093022208.0;  // 2^43

/// Nearest whole number of a value in (-4096, 2^22), such as an image coordinate (halves and the
/// last 2^-11 go up). Inlines to two instructions, which std::lround does not.
inline int roundNearest(float x) {
    return static_cast<int>(x + 4096.5F) - 4096;
}

inline float weightOf(std::uint16_t code) {
    return Weight::decode(static_cast<std::uint16_t>(code & ~kHighBit));
}
/// The smaller weight; high only if both are: an edge once seen low stays low.
inline std::uint16_t smallerWeight(std::uint16_t a, std::uint16_t b) {
    const unsigned weight = std::min(a & 0x7FFFU, b & 0x7FFFU);
    return static_cast<std::uint16_t>(weight | (static_cast<unsigned>(a & b) & kHighBit));
}

/// Unit vector in 2 x 16 bits (octahedral map, error below 1e-4 rad); 0 = no direction.
inline std::uint32_t encodeDirection(const Eigen::Vector3f& n) {
    const float sum = std::abs(n.x()) + std::abs(n.y()) + std::abs(n.z());
    if (!(sum > 0.0F)) {
        return 0;
    }
    float u = n.x() / sum;
    float v = n.y() / sum;
    if (n.z() < 0.0F) {
        const float fold = u;
        u = (1.0F - std::abs(v)) * (fold < 0.0F ? -1.0F : 1.0F);
        v = (1.0F - std::abs(fold)) * (v < 0.0F ? -1.0F : 1.0F);
    }
    // 1..65535, so that a direction is never the code 0.
    const auto quantise = [](float x) {
        return static_cast<std::uint32_t>((x + 1.0F) * 32767.0F + 1.5F);
    };
    return quantise(u) | (quantise(v) << 16U);
}
inline Eigen::Vector3f decodeDirection(std::uint32_t code) {
    if (code == 0) {
        return Eigen::Vector3f::Zero();
    }
    const float u = (static_cast<float>(code & 0xFFFFU) - 1.0F) / 32767.0F - 1.0F;
    const float v = (static_cast<float>(code >> 16U) - 1.0F) / 32767.0F - 1.0F;
    Eigen::Vector3f n(u, v, 1.0F - std::abs(u) - std::abs(v));
    if (n.z() < 0.0F) {
        n.x() = (1.0F - std::abs(v)) * (u < 0.0F ? -1.0F : 1.0F);
        n.y() = (1.0F - std::abs(u)) * (v < 0.0F ? -1.0F : 1.0F);
    }
    return n.normalized();
}

}  // namespace riftmap::compact
