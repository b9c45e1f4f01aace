// SPDX-License-Identifier: BSD-3-Clause
// Section VII of the paper: is what an edge spans seen through?
#pragma once

#include <Eigen/Core>

#include "riftmap/graph/pixel_graph.h"
#include "view_points.h"

namespace riftmap {

/// Calls f(column, row) for each pixel of Bresenham's line, ends included.
template <class F>
void forEachLinePixel(int c0, int r0, int c1, int r1, F&& f) {
    const int dc = c1 > c0 ? c1 - c0 : c0 - c1, dr = r1 > r0 ? r1 - r0 : r0 - r1;
    const int stepC = c0 < c1 ? 1 : -1, stepR = r0 < r1 ? 1 : -1;
    int error = dc - dr;
    for (;;) {
        f(c0, r0);
        if (c0 == c1 && r0 == r1) {
            return;
        }
        const int twice = 2 * error;
        if (twice > -dr) {
            error -= dr;
            c0 += stepC;
        }
        if (twice < dc) {
            error += dc;
            r0 += stepR;
        }
    }
}

/// Eqs. (5)-(8) along the edge between two points of the camera frame [m]: true if more than
/// `options.visibility` of the line's pixels show surface behind the edge.
///
/// The paper counts every pixel. With fusion by inverse variance the two end pixels are left out
/// (they show the ends themselves) and "behind" must exceed gamma and the noise.
bool seenThrough(const ViewPoints& view, const Eigen::Vector3f& a, const Eigen::Vector3f& b,
                 const GraphOptions& options);

}  // namespace riftmap
