// SPDX-License-Identifier: BSD-3-Clause
// Fusion of a page with the pixels that show its vertices, in vector code. The same bytes on every
// machine.
#pragma once

#include <cstdint>

#include "association.h"
#include "riftmap/graph/graph_storage.h"
#include "view_points.h"

namespace riftmap {

inline constexpr float kTinySigma = 1e-6F;   ///< [m]
inline constexpr float kLeastSigma = 1e-4F;  ///< [m] nothing is known better by one view
inline constexpr float kSameSide = 0.7F;     ///< cosine of 45 degrees
inline constexpr float kNoisy = 0.25F;       ///< sigma per spacing above which normals are patches'

/// The vertices of a page and what the pixels that matched them say.
struct PageFusion {
    std::uint64_t inView = 0;                     ///< slots that may be matched
    const Association::Claims* claims = nullptr;  ///< of the slots
    const float* before = nullptr;                ///< sigma of the slots until now [m]
    bool firstStays = false;                      ///< the paper: the first position and colour stay
    bool typedOpenness = true;
    float targetResolution = 0;  ///< [m]
    // Results.
    std::uint64_t matched = 0;  ///< slots
    std::uint64_t moved = 0;    ///< slots to fit a normal to again
    std::int64_t area = 0;      ///< change of the page's surface [compact::areaUnits]
    bool touched = false;       ///< a vertex is open or was
};

/// OpenKind bits of a vertex with these of its pixels, state and sigma.
inline std::uint8_t openBits(unsigned kinds, unsigned state, float sigma, bool typedOpenness,
                             float targetResolution) {
    unsigned bits = (state & kSurrounded) != 0 ? 0U : kinds & ~unsigned{kTooCoarse};
    if (typedOpenness && ((state & kFineEnough) == 0 || 2 * sigma > targetResolution)) {
        bits |= kTooCoarse;
    }
    return static_cast<std::uint8_t>(bits);
}

/// Inverse-variance fusion of the matched vertices of a page, along and across the ray: position,
/// sigma, colour and, where noise hides the slope between neighbours, normal. Then what the view
/// says beside: state, openness and share of the surface.
void fuseMatched(const ViewPoints& view, Page& page, PageFusion& fusion);

}  // namespace riftmap
