// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/stereo_matcher.h"

#include <string>
#include <utility>

#include "riftmap/stereo/disparity_filters.h"
#include "riftmap/stereo/disparity_refiner.h"
#include "riftmap/stereo/grey.h"
#include "riftmap/stereo/opencv_matchers.h"
#include "riftmap/stereo/paper_matcher.h"

namespace riftmap {

void StereoOptions::describe(OptionTable& table) {
    table.section("Stereo", "From a rectified pair to disparity.");
    table.addChoice<MatcherKind>("matcher", matcher,
                                 {{"paper", MatcherKind::kPaper},
                                  {"opencv_bm", MatcherKind::kOpenCvBlock},
                                  {"opencv_sgbm", MatcherKind::kOpenCvSgbm},
                                  {"given", MatcherKind::kGiven}},
                                 "Which matcher; given: the source measures disparity itself.");
    table.add("min_disparity", minDisparity, -4096, 4096, "px", "Least disparity searched.");
    table.add("num_disparities", numDisparities, 1, 1024, "",
              "How many disparities are searched, 1 px apart.");
    table.add("window", window, 3, 21, "px", "Side of the square correlation window; odd.");
    table.addChoice<Prefilter>(
        "prefilter", prefilter,
        {{"none", Prefilter::kNone}, {"dog", Prefilter::kDog}, {"gradient", Prefilter::kGradient}},
        "What is matched: the image, its difference of Gaussians (the paper), or its derivative "
        "along the row.");
    table.add("prefilter_gain", prefilterGain, 1, 16, "", "Factor on the filtered image.");
    table.add("prefilter_cap", prefilterCap, 1, 127, "grey levels",
              "Filtered values are clipped to plus and minus this.");
    table.add("truncation", truncation, 1, 127, "grey levels",
              "Largest difference that one pixel counts with.");
    table.add("supporting_windows", supportingWindows,
              "Match with five small windows that share out the window, the centre and the better "
              "two of the corners, instead of one.");
    table.add("semi_global", semiGlobal,
              "Let each match agree with its neighbours along the row (semi-global matching).");
    table.add("penalty_small", penaltySmall, 0.0, 60.0, "grey levels",
              "Semi-global: cost of a step of 1 px, a pixel of the window.");
    table.add("penalty_large", penaltyLarge, 0.0, 60.0, "grey levels",
              "Semi-global: cost of a larger step, a pixel of the window.");
    table.add("anchor_reach", anchorReach, 0, 1024, "px",
              "Semi-global: how far a match is carried along the row beyond a pixel whose window "
              "alone is sure of it.");
    table.add("anchor_margin", anchorMargin, 0.0, 60.0, "grey levels",
              "Semi-global: a window is sure of its match where every rival is worse by so much, a "
              "pixel of the window; more than noise makes of it.");
    table.add("uniqueness_margin", uniquenessMargin, 0.0, 60.0, "grey levels",
              "Added to the share of uniqueness, a pixel of the window.");
    table.add("sharpness", sharpness, 0.0, 255.0, "grey levels",
              "Least second difference of the cost at its minimum, a pixel of the window.");
    table.add("guard", guard, 0, 1024, "px",
              "Surfaces nearer than the range are looked for so far beyond it, at a quarter of the "
              "resolution, so that they do not match wrongly within it; 0: off.");
    table.add("left_right_check", leftRightCheck,
              "Discard matches that the right image does not agree with.");
    table.add("left_right_tolerance", leftRightTolerance, 0, 16, "px",
              "Largest difference of the two directions.");
    table.add("uniqueness", uniqueness, 0, 100, "%",
              "The second best minimum must be worse by this share.");
    table.add("subpixel", subpixel, "Fit a parabola to the minimum.");
    table.add("isolated_size", isolatedSize, 0, 1000000, "px",
              "Groups of fewer pixels of similar disparity are discarded; 0 keeps all.");
    table.add("isolated_difference", isolatedDifference, 0.0, 16.0, "px",
              "Neighbours that differ by no more belong together.");
    table.add(
        "rim_texture", rimTexture, 0, 255, "grey levels",
        "Matches at the rim of matched surface are discarded where their 3 x 3 pixels span no "
        "more: flat background takes on the disparity of what is beside it. Four to five "
        "times the noise of a sample, or 0: keeps all.");
    table.add(
        "silhouette_reach", silhouetteReach, 0, 10, "px",
        "Pixels so few columns from a farther surface are discarded: windows make silhouettes "
        "fatter; 0 keeps all.");
    table.add("silhouette_rows", silhouetteRows, 0, kMaxSilhouetteRows, "px",
              "The same up and down: there the left/right check does not help.");
    table.add("silhouette_step", silhouetteStep, 0.5, 64.0, "px",
              "Disparity by which a farther surface is lower, at least.");
    table.add("refine", refine, 0, 10, "",
              "Iterations of least squares between the images after matching, along the surface's "
              "slope (DisparityRefiner): two halve the error on rendered views; 0: none.");
    table.add("sigma_floor", sigmaFloor, 0.001, 10.0, "px",
              "Least standard deviation of a matched disparity.");
    table.add("sigma_noise", sigmaNoise, 0.0, 100.0, "",
              "Growth of the standard deviation with the images' noise, as the window sums it up, "
              "over the curvature of the minimum.");
    table.add(
        "sigma_mismatch", sigmaMismatch, 0.0, 10.0, "",
        "Growth of the standard deviation with the part of the least cost that noise does not "
        "explain, over the curvature.");
    table.add("sigma_slope", sigmaSlope, 0.0, 10.0, "",
              "Growth of the standard deviation with the change of disparity a pixel: windows mix "
              "what they see.");
    table.add("image_noise", imageNoise, 0.0, 64.0, "grey levels",
              "Standard deviation of an image sample; 0: measured in every left image.");
    table.add("sigma_d", sigmaGiven, 0.001, 10.0, "px",
              "Standard deviation of a given disparity that comes without one.");
    table.add("facet_radius", facetRadius, 0, 7, "px",
              "Given disparities whose noise is independent from pixel to pixel are smoothed over "
              "so much to each side, where the surface is smooth; 0: not.");
    table.add("max_depth_sigma", maxDepthSigma, 0.0, 100.0, "m",
              "Pixels whose depth is known worse (standard deviation) show free space, but are no "
              "surface of the map; 0: no limit.");
}

namespace {

std::unique_ptr<StereoMatcher> makePlainMatcher(const StereoOptions& options) {
    switch (options.matcher) {
        case MatcherKind::kPaper:
            return std::make_unique<PaperMatcher>(options);
        case MatcherKind::kOpenCvBlock:
            return std::make_unique<OpenCvBlockMatcher>(options);
        case MatcherKind::kOpenCvSgbm:
            return std::make_unique<OpenCvSgbmMatcher>(options);
        case MatcherKind::kGiven:
            break;
    }
    return nullptr;
}

class RefinedMatcher : public StereoMatcher {
 public:
    RefinedMatcher(std::unique_ptr<StereoMatcher> matcher, int iterations)
        : matcher_(std::move(matcher)), iterations_(iterations) {}
    void compute(const cv::Mat& left, const cv::Mat& right, DisparityImage& out) override {
        matcher_->compute(left, right, out);
        toGreyPair(left, right, grey_);
        refiner_.apply(grey_.left, grey_.right, iterations_, out);
    }

 private:
    std::unique_ptr<StereoMatcher> matcher_;
    int iterations_;
    GreyPair grey_;
    DisparityRefiner refiner_;
};

}  // namespace

std::unique_ptr<StereoMatcher> makeStereoMatcher(const StereoOptions& options) {
    if (options.window % 2 == 0) {
        throw ConfigError("[Stereo] window = " + std::to_string(options.window) +
                          ": allowed: odd, 3 .. 21");
    }
    auto matcher = makePlainMatcher(options);
    if (matcher && options.refine > 0) {
        return std::make_unique<RefinedMatcher>(std::move(matcher), options.refine);
    }
    return matcher;
}

}  // namespace riftmap
