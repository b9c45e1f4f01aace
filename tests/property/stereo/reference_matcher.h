// SPDX-License-Identifier: BSD-3-Clause
// PaperMatcher once more, pixel by pixel as one would explain it: slow and obvious.
#pragma once

#include <opencv2/core/mat.hpp>

#include "riftmap/core/view.h"
#include "riftmap/stereo/stereo_options.h"

namespace riftmap::reference {

/// `left`, `right`: CV_8UC1 of one size.
DisparityImage match(const cv::Mat& left, const cv::Mat& right, const StereoOptions& options);

}  // namespace riftmap::reference
