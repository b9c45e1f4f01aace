// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/stereo_matcher.h"

#include "riftmap/stereo/opencv_matchers.h"

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
    table.add("image_noise", imageNoise, 0.0, 64.0, "grey levels",
              "Standard deviation of an image sample.");
    table.add("sigma_floor", sigmaFloor, 0.001, 10.0, "px",
              "Least standard deviation of a matched disparity.");
    table.add("sigma_d", sigmaGiven, 0.001, 10.0, "px",
              "Standard deviation of a given disparity that comes without one.");
}

std::unique_ptr<StereoMatcher> makeStereoMatcher(const StereoOptions& options) {
    if (options.window % 2 == 0) {
        throw ConfigError("[Stereo] window = " + std::to_string(options.window) +
                          ": allowed: odd, 3 .. 21");
    }
    switch (options.matcher) {
        case MatcherKind::kPaper:
        case MatcherKind::kOpenCvBlock:
            return std::make_unique<OpenCvBlockMatcher>(options);
        case MatcherKind::kOpenCvSgbm:
            return std::make_unique<OpenCvSgbmMatcher>(options);
        case MatcherKind::kGiven:
            break;
    }
    return nullptr;
}

}  // namespace riftmap
