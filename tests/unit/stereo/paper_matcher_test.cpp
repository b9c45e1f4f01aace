// SPDX-License-Identifier: BSD-3-Clause
// What PaperMatcher must not see: surfaces where there is nothing to match.
#include "riftmap/stereo/paper_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

namespace riftmap {
namespace {

struct Settings {
    const char* name;
    bool semiGlobal;
};

double matchedPercentWith(const StereoOptions& options, const cv::Mat& left, const cv::Mat& right) {
    PaperMatcher matcher(options);
    DisparityImage d;
    matcher.compute(left, right, d);
    const auto n = std::count_if(d.disparity.begin(), d.disparity.end(),
                                 [](float v) { return std::isfinite(v); });
    return 100.0 * static_cast<double>(n) / static_cast<double>(left.total());
}

class PaperMatcherOn : public ::testing::TestWithParam<Settings> {
 protected:
    StereoOptions options() const {
        StereoOptions o;
        o.semiGlobal = GetParam().semiGlobal;
        if (o.semiGlobal) {
            o.prefilter = Prefilter::kGradient;
            o.prefilterGain = 1;
            o.prefilterCap = 31;
            o.truncation = 62;
            o.window = 7;
            o.anchorReach = 48;
            o.leftRightTolerance = 1;
            o.isolatedSize = 200;
        }
        return o;
    }
    double matchedPercent(const cv::Mat& left, const cv::Mat& right) const {
        return matchedPercentWith(options(), left, right);
    }
};

cv::Mat texture(int width, int height, int seed) {
    cv::Mat t(height, width, CV_8UC1);
    cv::RNG rng(static_cast<std::uint64_t>(seed));
    rng.fill(t, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(t, t, {5, 5}, 1.0);
    return t;
}

TEST_P(PaperMatcherOn, FlatGreyMatchesNothing) {
    const cv::Mat flat(200, 320, CV_8UC1, cv::Scalar(120));
    EXPECT_EQ(matchedPercent(flat, flat), 0);
}

TEST_P(PaperMatcherOn, UnrelatedNoiseMatchesHardlyAnything) {
    cv::Mat left(200, 320, CV_8UC1), right(200, 320, CV_8UC1);
    cv::RNG rng(5);
    rng.fill(left, cv::RNG::UNIFORM, 0, 256);
    rng.fill(right, cv::RNG::UNIFORM, 0, 256);
    EXPECT_LT(matchedPercent(left, right), GetParam().semiGlobal ? 2.0 : 0.5);
}

TEST_P(PaperMatcherOn, RepetitivePatternMatchesNothing) {
    for (const int period : {4, 8, 16}) {
        cv::Mat left(200, 320, CV_8UC1), right(200, 320, CV_8UC1);
        for (int y = 0; y < left.rows; ++y) {
            for (int x = 0; x < left.cols; ++x) {
                left.at<std::uint8_t>(y, x) = x % period < period / 2 ? 60 : 190;
                right.at<std::uint8_t>(y, x) = (x + 5) % period < period / 2 ? 60 : 190;
            }
        }
        EXPECT_EQ(matchedPercent(left, right), 0) << period;
    }
}

/// As a camera sees it: with noise, which alone makes one period better than the others.
TEST_P(PaperMatcherOn, NoisyRepetitivePatternMatchesHardlyAnything) {
    cv::Mat left(200, 320, CV_8UC1), right(200, 320, CV_8UC1);
    cv::RNG rng(21);
    for (int y = 0; y < left.rows; ++y) {
        for (int x = 0; x < left.cols; ++x) {
            const auto grey = [&](int at) {
                return cv::saturate_cast<std::uint8_t>((at % 8 < 4 ? 60 : 190) + rng.gaussian(2));
            };
            left.at<std::uint8_t>(y, x) = grey(x);
            right.at<std::uint8_t>(y, x) = grey(x + 5);
        }
    }
    EXPECT_LT(matchedPercent(left, right), 1);
}

/// A textured box before a flat wall or the sky, which take on its disparity as far as the window
/// reaches: with the noise told, the box keeps its own size.
TEST_P(PaperMatcherOn, FlatBackgroundBesideASurfaceIsNoMatch) {
    const cv::Mat near = texture(300, 160, 16);
    const cv::Rect box(200, 50, 150, 100);
    cv::Mat left(200, 512, CV_8UC1, cv::Scalar(128)), right = left.clone();
    near(cv::Rect(0, 0, box.width, box.height)).copyTo(left(box));
    near(cv::Rect(0, 0, box.width, box.height)).copyTo(right(box - cv::Point(30, 0)));
    cv::Mat noise(left.size(), CV_16SC1);
    for (cv::Mat* image : {&left, &right}) {
        cv::randn(noise, 0, 1.5);
        cv::add(*image, noise, *image, cv::noArray(), CV_8U);
    }
    StereoOptions o = options();
    const auto outside = [&](const StereoOptions& with, int& inside) {
        PaperMatcher matcher(with);
        DisparityImage d;
        matcher.compute(left, right, d);
        int n = 0;
        inside = 0;
        for (int r = 0; r < d.height; ++r) {
            for (int c = d.firstColumn; c < d.width; ++c) {
                (box.contains({c, r}) ? inside : n) += d.valid(c, r) ? 1 : 0;
            }
        }
        return n;
    };
    int inside = 0;
    const int halo = outside(o, inside);
    o.rimTexture = 7;
    int kept = 0;
    const int remaining = outside(o, kept);
    EXPECT_GT(halo, 500) << "the window casts no halo: the test says little";
    EXPECT_LT(remaining, halo / 5);
    EXPECT_GT(kept, inside * 95 / 100);
}

TEST_P(PaperMatcherOn, TinyImagesDoNotCrash) {
    for (const auto size : {cv::Size(1, 1), cv::Size(320, 1), cv::Size(1, 50), cv::Size(64, 2),
                            cv::Size(65, 3), cv::Size(3, 200)}) {
        cv::Mat image(size, CV_8UC1);
        cv::RNG rng(7);
        rng.fill(image, cv::RNG::UNIFORM, 0, 256);
        EXPECT_EQ(matchedPercent(image, image), 0) << size.width << " x " << size.height;
    }
}

/// A surface nearer than the range by 2 to 56 px, over its whole width.
TEST_P(PaperMatcherOn, SurfaceNearerThanTheRangeIsNoMatch) {
    for (const int beyond : {2, 8, 20, 40, 56}) {
        const int d = options().numDisparities - 1 + beyond;
        const cv::Mat wide = texture(512 + d, 200, 11);
        const double percent = matchedPercent(wide.colRange(0, 512), wide.colRange(d, d + 512));
        EXPECT_LT(percent, GetParam().semiGlobal ? 2.5 : 1.0) << d << " px";
    }
}

/// The same with a strip of the surface in the range beside it, which must stay.
TEST_P(PaperMatcherOn, SurfaceInTheRangeStaysBesideANearerOne) {
    const cv::Mat far = texture(600, 240, 12), near = texture(600, 240, 13);
    cv::Mat left = far.colRange(0, 512).clone();
    cv::Mat right = far.colRange(20, 532).clone();  // 20 px
    const cv::Rect box(300, 60, 150, 120);
    near(box).copyTo(left(box));
    near(box).copyTo(right(box - cv::Point(90, 0)));  // 90 px: beyond the range's 63
    PaperMatcher matcher(options());
    DisparityImage d;
    matcher.compute(left, right, d);
    int invented = 0, farMatched = 0, farPixels = 0;
    for (int r = 0; r < d.height; ++r) {
        for (int c = d.firstColumn; c < d.width; ++c) {
            if (box.contains({c, r})) {
                invented += d.valid(c, r) ? 1 : 0;
            } else if (c < 150 || r < 40 || r > 200) {
                ++farPixels;
                farMatched += d.valid(c, r) && std::abs(d.at(c, r) - 20) < 1 ? 1 : 0;
            }
        }
    }
    // The semi-global pass carries the far surface a little further into the near one.
    EXPECT_LT(invented, box.area() * (GetParam().semiGlobal ? 3 : 1) / 100);
    EXPECT_GT(farMatched, farPixels * 95 / 100);
}

TEST_P(PaperMatcherOn, TakesAnyRange) {
    const cv::Mat wide = texture(400, 100, 14);
    for (const int minimum : {-20, -7, 5, 30}) {
        StereoOptions o = options();
        o.minDisparity = minimum;
        o.numDisparities = 21;
        const int d = minimum + 9;
        PaperMatcher matcher(o);
        DisparityImage found;
        matcher.compute(wide.colRange(30, 350), wide.colRange(30 + d, 350 + d), found);
        EXPECT_NEAR(found.at(200, 50), static_cast<float>(d), 0.1F) << minimum;
    }
}

INSTANTIATE_TEST_SUITE_P(Stages, PaperMatcherOn,
                         ::testing::Values(Settings{"windows", false},
                                           Settings{"semi_global", true}),
                         [](const auto& p) { return std::string(p.param.name); });

TEST(PaperMatcher, RefusesAnEvenWindow) {
    StereoOptions o;
    o.window = 10;
    EXPECT_THROW(PaperMatcher{o}, ConfigError);
}

/// A plane that slants through the range: parabola and sigma.
TEST(PaperMatcher, SubpixelOfASlantedPlane) {
    const cv::Mat source = texture(700, 160, 15);
    cv::Mat mapX(160, 512, CV_32FC1), mapY(160, 512, CV_32FC1);
    const auto disparity = [](int x) { return 10 + 0.04F * static_cast<float>(x); };
    for (int y = 0; y < 160; ++y) {
        for (int x = 0; x < 512; ++x) {  // left pixel x shows what the right shows at x - d
            mapX.at<float>(y, x) = static_cast<float>(x) - disparity(x) + 60;
            mapY.at<float>(y, x) = static_cast<float>(y);
        }
    }
    cv::Mat left;
    cv::remap(source, left, mapX, mapY, cv::INTER_CUBIC);
    PaperMatcher matcher{StereoOptions()};
    DisparityImage d;
    matcher.compute(left, source.colRange(60, 572), d);
    double sum = 0, n = 0;
    for (int y = 10; y < 150; ++y) {
        for (int x = 80; x < 500; ++x) {
            if (d.valid(x, y)) {
                const double e = static_cast<double>(d.at(x, y) - disparity(x));
                sum += e * e;
                ++n;
                EXPECT_GE(d.sigma[d.index(x, y)], static_cast<float>(StereoOptions().sigmaFloor));
            }
        }
    }
    EXPECT_GT(n, 140 * 420 * 0.95);
    EXPECT_LT(std::sqrt(sum / n), 0.25);
}

}  // namespace
}  // namespace riftmap
