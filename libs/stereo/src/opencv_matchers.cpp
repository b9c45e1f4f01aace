// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/opencv_matchers.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "riftmap/stereo/disparity_filters.h"
#include "riftmap/stereo/grey.h"
#include "riftmap/stereo/image_noise.h"

namespace riftmap {
namespace {

int roundedRange(int numDisparities) {
    return (numDisparities + 15) / 16 * 16;
}

/// Standard deviation of a disparity after the least-squares bound: noise of both images over the
/// gradient along the row that the window holds.
void fillSigma(const cv::Mat& grey, const StereoOptions& options, int window, DisparityImage& out) {
    cv::Mat gradient, energy;
    cv::Sobel(grey, gradient, CV_32F, 1, 0, 1, 0.5);
    cv::boxFilter(gradient.mul(gradient), energy, CV_32F, {window, window}, {-1, -1}, false);
    const double floor = std::max(options.sigmaFloor, 0.2);  // fitted to Motorcycle's truth
    const double sample = options.imageNoise > 0 ? options.imageNoise : NoiseMeter().measure(grey);
    constexpr double kShort = 2;  // of the bound that matchers stay, fitted likewise
    const double noise = 2 * (kShort * sample) * (kShort * sample);
    for (int r = 0; r < out.height; ++r) {
        for (int c = 0; c < out.width; ++c) {
            if (out.valid(c, r)) {
                const double e = std::max(1.0, static_cast<double>(energy.at<float>(r, c)));
                out.sigma[out.index(c, r)] =
                    static_cast<float>(std::sqrt(floor * floor + noise / e));
            }
        }
    }
}

void computeWith(cv::StereoMatcher& matcher, const StereoOptions& options, int window,
                 const cv::Mat& left, const cv::Mat& right, cv::Mat& raw, DisparityImage& out) {
    GreyPair grey;
    toGreyPair(left, right, grey);
    out.resize(grey.left.cols, grey.left.rows);
    out.minDisparity = static_cast<float>(options.minDisparity);
    out.maxDisparity = static_cast<float>(options.minDisparity + options.numDisparities - 1);
    out.firstColumn = std::clamp(options.minDisparity + options.numDisparities - 1, 0, out.width);
    // The columns that cv::StereoSGBM matches, of a range that is a multiple of 16. If there are
    // none, its three-way mode writes where there is no memory.
    const int firstMatched = std::max(options.minDisparity + matcher.getNumDisparities(), 0);
    const int endMatched = out.width + std::min(options.minDisparity, 0);
    if (endMatched <= firstMatched || std::min(out.width, out.height) <= window) {
        return;
    }
    matcher.compute(grey.left, grey.right, raw);
    constexpr float kScale = 1.0F / static_cast<float>(cv::StereoMatcher::DISP_SCALE);
    for (int r = 0; r < out.height; ++r) {
        const auto* row = raw.ptr<std::int16_t>(r);
        for (int c = out.firstColumn; c < out.width; ++c) {
            const float d = static_cast<float>(row[c]) * kScale;
            if (d >= out.minDisparity && d <= out.maxDisparity) {
                out.disparity[out.index(c, r)] = options.subpixel ? d : std::round(d);
            }
        }
    }
    IsolatedFilter().apply(out, options.isolatedSize,
                           static_cast<float>(options.isolatedDifference));
    fillSigma(grey.left, options, window, out);
}

}  // namespace

OpenCvBlockMatcher::OpenCvBlockMatcher(const StereoOptions& options)
    : options_(options), raw_(std::make_unique<cv::Mat>()) {
    options_.window = std::max(5, options_.window);
    auto matcher = cv::StereoBM::create(roundedRange(options.numDisparities), options_.window);
    matcher->setMinDisparity(options.minDisparity);
    matcher->setUniquenessRatio(options.uniqueness);
    matcher->setDisp12MaxDiff(options.leftRightCheck ? options.leftRightTolerance : -1);
    matcher_ = matcher;
}

OpenCvBlockMatcher::~OpenCvBlockMatcher() = default;

void OpenCvBlockMatcher::compute(const cv::Mat& left, const cv::Mat& right, DisparityImage& out) {
    computeWith(*matcher_, options_, options_.window, left, right, *raw_, out);
}

OpenCvSgbmMatcher::OpenCvSgbmMatcher(const StereoOptions& options, bool full)
    : options_(options), raw_(std::make_unique<cv::Mat>()) {
    constexpr int kWindow = 5;  // with the smoothness penalties of OpenCV's own sample
    options_.window = kWindow;
    matcher_ = cv::StereoSGBM::create(
        options.minDisparity, roundedRange(options.numDisparities), kWindow, 8 * kWindow * kWindow,
        32 * kWindow * kWindow, options.leftRightCheck ? options.leftRightTolerance : -1, 63,
        options.uniqueness, 0, 0, full ? cv::StereoSGBM::MODE_HH : cv::StereoSGBM::MODE_SGBM_3WAY);
}

OpenCvSgbmMatcher::~OpenCvSgbmMatcher() = default;

void OpenCvSgbmMatcher::compute(const cv::Mat& left, const cv::Mat& right, DisparityImage& out) {
    computeWith(*matcher_, options_, options_.window, left, right, *raw_, out);
}

}  // namespace riftmap
