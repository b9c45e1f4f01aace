// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "riftmap/core/view.h"
#include "riftmap/stereo/stereo_matcher.h"
#include "riftmap/stereo/stereo_options.h"

namespace cv {
class StereoMatcher;
}

namespace riftmap {

/// cv::StereoBM behind our interface. Its range is a multiple of 16: a search is widened to that,
/// and what lies beyond the range asked for is discarded. Its window has at least 5 pixels.
class OpenCvBlockMatcher : public StereoMatcher {
 public:
    explicit OpenCvBlockMatcher(const StereoOptions& options);
    ~OpenCvBlockMatcher() override;
    void compute(const cv::Mat& left, const cv::Mat& right, DisparityImage& out) override;

 private:
    StereoOptions options_;
    std::unique_ptr<cv::Mat> raw_;
    std::shared_ptr<cv::StereoMatcher> matcher_;
};

/// cv::StereoSGBM (three-way) behind our interface, with a 5x5 window as its authors advise; the
/// window of the options is not used.
class OpenCvSgbmMatcher : public StereoMatcher {
 public:
    explicit OpenCvSgbmMatcher(const StereoOptions& options, bool full = false);
    ~OpenCvSgbmMatcher() override;
    void compute(const cv::Mat& left, const cv::Mat& right, DisparityImage& out) override;

 private:
    StereoOptions options_;
    std::unique_ptr<cv::Mat> raw_;
    std::shared_ptr<cv::StereoMatcher> matcher_;
};

}  // namespace riftmap
