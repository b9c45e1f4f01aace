// SPDX-License-Identifier: BSD-3-Clause
// The inner loops over a view's pixels, in vector code. Every lane works as the scalar formula
// would, in its order and without contraction, so results are the same bytes on every machine.
#pragma once

#include <cstddef>
#include <cstdint>

#include "view_points.h"

namespace riftmap {

/// One row of a disparity image. Outputs are `width` long.
struct DepthRow {
    const float *disparity = nullptr, *deviation = nullptr;  ///< of the image [px]
    int width = 0;
    float doffs = 0, fb = 1;
    float *z = nullptr, *sigma = nullptr;  ///< 0 where there is no vertex [m]
    float* corrected = nullptr;            ///< disparity + doffs; not a number where no vertex [px]
};
/// Depth and its noise, sec. IV.A; returns the number of vertices.
std::size_t depthsOfRow(const DepthRow& row);

/// A row of patches. Image rows are given by columns modulo 4, a plane of `stride` values each,
/// with ViewPoints::kPhasePad values before the first column; rows outside of the image are all
/// invalid.
struct PatchRow {
    static constexpr int kWindow = 5;
    const float *near[kWindow] = {}, *far[kWindow] = {};  ///< 1 and 3 rows apart, middle = centre
    std::size_t stride = 0;
    const float* deviation = nullptr;  ///< of the centre row's disparities [px]
    int width = 0, row = 0;            ///< of the centre
    float fx = 1, fy = 1, cx = 0, cy = 0, fb = 1, footprint = 1;
    PatchPlane* patches = nullptr;
    int patchCount = 0;
};
/// Least-squares planes through windows of 5 x 5 pixels, once more without what lies off the plane.
void fitPatchRow(const PatchRow& row);

/// Viewing angles and surface a pixel, where the pixel lies on the plane of its patch.
struct AngleRow {
    const float *z = nullptr, *disparity = nullptr, *rayX = nullptr;
    float rayY = 0, fxfy = 1, rowsFromCentre = 0;
    int width = 0;
    /// Of the pixel's patch: disparity in the patch's centre row, slope, tolerance, 1 / distance.
    const float *value = nullptr, *slopeRow = nullptr, *tolerance = nullptr, *inverse = nullptr;
    float *stretch = nullptr, *area = nullptr;
};
/// Stretch 0 where the patch tells nothing; `onPlane` = 1 where it does.
void anglesOfRow(const AngleRow& row, std::uint8_t* onPlane);
/// z^2 / (fx fy |n . ray|), where 1 / |n . ray| = stretch / |ray|.
void areasOfRow(const AngleRow& row);

/// ViewPoints::look of a row.
struct LookRow {
    const std::uint8_t* image = nullptr;  ///< grey, or blue, green, red
    int channels = 0;                     ///< 0: no image
    const std::uint8_t* onPlane = nullptr;
    int width = 0;
    std::uint32_t* look = nullptr;
};
void looksOfRow(const LookRow& row);

/// Edges from each pixel of a row to one beside or below it.
struct EdgeRow {
    const float *z = nullptr, *sigma = nullptr, *rayX = nullptr;     ///< of the pixels
    const float *z2 = nullptr, *sigma2 = nullptr, *rayX2 = nullptr;  ///< of the pixels there
    float rayY = 0, rayY2 = 0;
    int count = 0;
    float delta = 0, target = 0, footprint = 1;
    std::uint16_t* code = nullptr;
};
/// Weights by eq. (3). The high bit says that weight, noise and spacing speak for a high edge; the
/// viewing angle may still explain it where delta = 0.
void edgesOfRow(const EdgeRow& row);

/// Kinds of the pixels [1, width - 1) of a row that has rows above and below.
struct KindRow {
    const float* z = nullptr;
    const std::uint16_t *right = nullptr, *down = nullptr, *downAbove = nullptr;
    int width = 0, firstColumn = 0;
    std::uint8_t* kinds = nullptr;
};
void kindsOfRow(const KindRow& row);

}  // namespace riftmap
