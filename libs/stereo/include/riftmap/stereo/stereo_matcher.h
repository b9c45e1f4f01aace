// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "riftmap/core/view.h"
#include "riftmap/stereo/stereo_options.h"

namespace riftmap {

/// Finds for each pixel of the left image its partner in the same row of the right one.
///
/// A matcher keeps its buffers from frame to frame: one object is used by one thread at a time.
class StereoMatcher {
 public:
    virtual ~StereoMatcher() = default;

    /// Disparity and its standard deviation for each pixel of `left`.
    ///
    /// `left`, `right`: a rectified pair of the same size, 8 or 16 bit, 1, 3 (BGR) or 4 channels.
    /// `out` is resized; all its fields are set. Throws std::invalid_argument where the images are
    /// empty, differ in size or have another format.
    virtual void compute(const cv::Mat& left, const cv::Mat& right, DisparityImage& out) = 0;
};

/// The matcher that the options name, with DisparityRefiner after it where `refine` > 0. Null for
/// MatcherKind::kGiven. Throws ConfigError for options that exclude one another.
std::unique_ptr<StereoMatcher> makeStereoMatcher(const StereoOptions& options);

}  // namespace riftmap
