// SPDX-License-Identifier: BSD-3-Clause
// Fusion of a page with the pixels that show its vertices, in vector code. The same bytes on every
// machine.
#pragma once

#include <array>
#include <cstdint>

#include "riftmap/graph/graph_storage.h"
#include "view_points.h"

namespace riftmap {

inline constexpr float kTinySigma = 1e-6F;   ///< [m]
inline constexpr float kLeastSigma = 1e-4F;  ///< [m] nothing is known better by one view
inline constexpr float kSameSide = 0.7F;     ///< cosine of 45 degrees
inline constexpr float kNoisy = 0.25F;       ///< sigma per spacing above which normals are patches'

/// The matched vertices of a page.
struct PageFusion {
    std::uint64_t matched = 0;                       ///< slots
    std::array<std::uint32_t, Page::kSize> pixel{};  ///< of a matched slot
    const float* before = nullptr;                   ///< sigma of the slots until now [m]
    std::array<float, Page::kSize> sigma{}, gain{};  ///< result: sigma now, weight of the pixel
    std::uint64_t moved = 0;                         ///< result: slots to fit a normal to again
    /// Result: slots whose normal until now lies more than 45 degrees off that of the pixel, where
    /// noise makes the gate wide: the pixel shows the surface round an edge.
    std::uint64_t roundEdge = 0;
};

/// Inverse-variance fusion of position and normal along and across the ray; writes the positions,
/// sigmas and, where noise hides the slope between neighbours, the normals of the page.
void fuseMatched(const ViewPoints& view, Page& page, PageFusion& fusion);

}  // namespace riftmap
