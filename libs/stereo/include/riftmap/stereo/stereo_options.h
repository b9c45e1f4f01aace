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

    Prefilter prefilter = Prefilter::kDog;
    int prefilterGain = 4;          ///< factor on the filtered image
    int prefilterCap = 127;         ///< filtered values are clipped to +- this [grey levels]
    int truncation = 30;            ///< largest difference that one pixel counts with [grey levels]
    bool supportingWindows = true;  ///< five small windows that share out the window
    bool semiGlobal = false;        ///< a semi-global pass along the row over the windows' costs
    double penaltySmall = 3;        ///< of a step of 1 px [grey levels a pixel of the window]
    double penaltyLarge = 20;       ///< of any larger step [grey levels a pixel of the window]
    double anchorMargin = 2;        ///< by which rivals are worse there [grey levels a pixel]
    int anchorReach = 24;  ///< how far the pass carries a match beyond what is sure by itself [px]

    int guard = 56;  ///< how far beyond the range nearer surfaces are looked for, coarsely [px]
    bool leftRightCheck = true;
    int leftRightTolerance = 2;   ///< largest difference of the two directions [px]
    int uniqueness = 1;           ///< the second best minimum is at least so much worse [%]
    double uniquenessMargin = 0;  ///< and by this [grey levels a pixel of the window]
    double sharpness = 0;         ///< least curvature of a minimum [grey levels a pixel]
    bool subpixel = true;
    int isolatedSize = 100;         ///< groups of fewer pixels are discarded; 0 keeps all [px]
    double isolatedDifference = 1;  ///< neighbours nearer than this belong together [px]
    int rimTexture = 0;             ///< 3 x 3 px that span no more are flat; 0: off [grey levels]
    int silhouetteReach = 3;        ///< pixels so near to a farther surface are discarded [columns]
    int silhouetteRows = 4;         ///< the same up and down [rows]
    double silhouetteStep = 4;      ///< what counts as farther: lower disparity by more [px]

    /// Iterations of DisparityRefiner after the matcher, by makeStereoMatcher() (a matcher by
    /// itself knows nothing of it); 0: none. They find parts of a pixel whatever `subpixel` says.
    int refine = 0;

    double sigmaFloor = 0.08;     ///< least standard deviation of a disparity [px]
    double sigmaNoise = 3.5;      ///< its growth with the images' noise over the curvature
    double sigmaMismatch = 0.43;  ///< its growth with what else is left of the cost
    double sigmaSlope = 0.3;      ///< its growth with the change of disparity from pixel to pixel
    double imageNoise = 0;        ///< standard deviation of a sample; 0: measured [grey levels]
    double sigmaGiven = 0.1;      ///< standard deviation of a given disparity [px]
    /// Given disparities are smoothed over so much to each side (FacetFilter) [px]; 0: not.
    int facetRadius = 3;
    /// Depth known worse than that (standard deviation) shows that the space before it is free, but
    /// is no surface of the map [m]; 0: no limit.
    double maxDepthSigma = 0;

    /// Adds section [Stereo] to the table.
    void describe(OptionTable& table);
};

}  // namespace riftmap
