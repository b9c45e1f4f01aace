// SPDX-License-Identifier: BSD-3-Clause
// Projection of the map into a view, in vector code. The same bytes on every machine.
#pragma once

#include <array>
#include <cstdint>

#include "riftmap/graph/graph_storage.h"

namespace riftmap {

/// What projecting a page needs to know of the view.
struct Projection {
    std::array<float, 9> rotation{};  ///< world_R_camera, column by column
    std::array<float, 3> translation{};
    float fx = 1, fy = 1, cx = 0, cy = 0;
    int width = 0, height = 0;
    float nearest = 0;             ///< [m] what lies nearer is not in view
    float border = 0;              ///< [px] room around the image
    const float* reach = nullptr;  ///< tile -> depth beyond which nothing matches [m]
    int tileColumns = 0;           ///< tiles of 8 x 8 pixels in a row
    float noiseGate = 0;           ///< standard deviations a vertex may lie behind that
};

/// The 64 vertices of a page as the camera would see them.
struct ProjectedPage {
    float *u = nullptr, *v = nullptr;  ///< column, row [px]
    float* z = nullptr;                ///< depth [m]; 0 = not in view
    float* sigma = nullptr;            ///< [m]
    std::uint32_t* pixel = nullptr;    ///< nearest pixel of the image; only where in view
    std::uint64_t inView = 0;          ///< a bit a slot
    int firstRow = 0, lastRow = -1;    ///< of those pixels
};

/// Eq. (4) for a page.
void projectPage(const Page& page, const Projection& view, ProjectedPage& out);

/// For each pixel of a row z + its gate's depth, or what is there if that is more [m].
struct ReachRow {
    const float *z = nullptr, *sigma = nullptr, *stretch = nullptr;
    int width = 0;
    float gamma = 0, footprint = 1;
    bool gammaOnly = false;  ///< the paper's gate
};
void reachOfRow(const ReachRow& row, float* most);

}  // namespace riftmap
