// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "riftmap/core/options.h"

namespace riftmap {

/// Which matcher turns a rectified pair into disparity.
enum class MatcherKind {
    kPaper,        ///< the paper's (sections IV.A and IX.B), our own kernel
    kOpenCvBlock,  ///< cv::StereoBM
    kOpenCvSgbm,   ///< cv::StereoSGBM, three-way
    kGiven,        ///< none: the observation brings its disparity
};

/// What PaperMatcher does to the images first.
enum class Prefilter {
    kNone,
    kDog,       ///< difference of Gaussians (the paper)
    kGradient,  ///< derivative along the row (Sobel)
};

/// Section [Stereo]: from a rectified pair to disparity.
struct StereoOptions {
    MatcherKind matcher = MatcherKind::kPaper;
    int minDisparity = 0;     ///< least disparity searched [px]; may be negative
    int numDisparities = 64;  ///< how many disparities are searched, 1 px apart; > 0
    int window = 11;          ///< side of the correlation window [px], odd, 3..21
    Prefilter prefilter = Prefilter::kGradient;
    int prefilterGain = 1;          ///< factor on the filtered image
    int prefilterCap = 31;          ///< filtered values are clipped to +- this [grey levels]
    int truncation = 62;            ///< largest difference of one pixel [grey levels]
    bool supportingWindows = true;  ///< several small windows instead of one
    double sharpness = 0.0;         ///< least curvature of a minimum [grey levels a pixel]
    bool leftRightCheck = true;
    int leftRightTolerance = 1;  ///< largest difference of the two directions [px]
    int uniqueness = 5;          ///< the second best minimum is at least so much worse [%]
    bool subpixel = true;
    int isolatedSize = 100;           ///< groups of fewer pixels are discarded; 0 keeps all [px]
    double isolatedDifference = 1.0;  ///< neighbours nearer than this belong together [px]
    double imageNoise = 2.0;          ///< standard deviation of an image sample [grey levels]
    double sigmaFloor = 0.1;          ///< least standard deviation of a disparity [px]
    double sigmaGiven = 0.1;          ///< standard deviation of a given disparity [px]

    /// Adds section [Stereo] to the table.
    void describe(OptionTable& table);
};

}  // namespace riftmap
