// SPDX-License-Identifier: BSD-3-Clause
// Real pairs with true disparity, and the score of a matcher against them.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "riftmap/core/view.h"

namespace riftmap::bench {

/// A pair of Middlebury's with truth.
struct Pair {
    std::string name;
    cv::Mat left, right;  ///< BGR, 8 bit
    cv::Mat truth;        ///< CV_32F [px], infinity = unknown
    int numDisparities;   ///< the range that covers the truth
    double truthSigma;    ///< standard deviation of the truth itself [px]
    cv::Mat visible;      ///< CV_8U, 255: truth known and the partner seen in the right image
    cv::Mat nearStep;     ///< CV_8U, 255: within 6 px of a step of the truth of 2 px or more
};

/// The pair in `folder` (laid out as in the data folder), or nothing where it is not there.
/// Throws std::runtime_error for files that cannot be read. Names: motorcycle aloe cones tsukuba.
std::optional<Pair> loadPair(const std::string& folder, const std::string& name);

/// Reads the only array of an .npz archive: 2-D float32, C order, stored or deflated.
cv::Mat readNpz(const std::string& file);

/// Shares in percent. All but `occluded` over pixels that both images see.
struct Score {
    double matched = 0;       ///< of the pixels with truth
    double bad1 = 0;          ///< of the matched ones: off by more than 1 px
    double bad2 = 0;          ///< ... 2 px
    double meanError = 0;     ///< of the matched ones [px]
    double matchedSteps = 0;  ///< the same within 6 px of depth steps
    double bad1Steps = 0;
    double bad2Steps = 0;
    double meanErrorSteps = 0;
    double occluded = 0;  ///< matched share of the pixels that the right image does not see
    /// Standard deviation of error / sigma of the matches within 1 px; sigma with the truth's own.
    double residual = 0;
};

Score score(const Pair& pair, const DisparityImage& disparity);

}  // namespace riftmap::bench
