// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "riftmap/core/view.h"

namespace riftmap {

/// Refines matched disparities by the images themselves: the iteration of Lucas and Kanade ("An
/// iterative image registration technique with an application to stereo vision", 1981), the
/// surface's slope included.
///
/// A matcher compares windows of one disparity each. On slanted and curved surface no such window
/// fits, which shifts the minimum, and the parabola through three costs is not the cost's shape.
/// Here each pixel of a window is taken from the right image by its own disparity, so the window
/// follows the surface, and what is common to the differences that are left over moves the pixel.
/// One iteration:
/// 1. Smooth: a plane through the matches within 3 px, of those that differ by 1.5 px at most (one
///    surface); its value at the pixel. It keeps errors of single pixels from growing.
/// 2. Warp: difference e of the left image and the right one at x - d (cubic), gradient g along the
///    row, mean of both images.
/// 3. Move by the least squares of e = -g m over 7 x 7 px, without the mean of both (light):
///    m = -cov(g, e) / (var(g) + r / s^2), with the sum of squares each, r the variance of what is
///    left of e (at least that of rounded samples) and s the sigma of the matcher: where there is
///    little texture the matcher has the say. At most half a pixel.
///
/// Last, smoothed once more. The new sigma^2 is 1 / (1 / s^2 + var(g) / r) + 0.2 s^2 + 0.4 s^4
/// [px]: fitted to rendered views of objects and rooms with known error; a match that the matcher
/// doubts (s of half a pixel and more) is mostly a wrong one, and stays doubtful. On real pairs it
/// is up to a third too small.
///
/// Work in proportion to the pixels and iterations, rows in parallel. Same bytes for any number of
/// threads. Keeps its images: one object is used by one thread at a time.
class DisparityRefiner {
 public:
    /// `left`, `right`: the rectified pair, 8 bit grey, of the image's size. `iterations` 0:
    /// nothing is done. Pixels without a match stay without. Throws std::invalid_argument where
    /// formats or sizes differ.
    void apply(const cv::Mat& left, const cv::Mat& right, int iterations, DisparityImage& image);

 private:
    void smooth(DisparityImage& image);
    void warp(const cv::Mat& left, const cv::Mat& right, const DisparityImage& image);
    void move(DisparityImage& image);

    std::vector<float> padded_;    ///< disparities, with infinity on both sides of a row [px]
    std::vector<float> compared_;  ///< 1: the pixel has a partner, else 0
    std::vector<float> gradient_, difference_;  ///< [grey levels a pixel], [grey levels]
    std::vector<float> matched_;                ///< sigma of the matcher [px]
};

}  // namespace riftmap
