// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/view_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "riftmap/core/options.h"
#include "riftmap/stereo/disparity_filters.h"
#include "riftmap/stereo/grey.h"

namespace riftmap {
namespace {

using ::testing::HasSubstr;

/// A fronto-parallel plane at one disparity: smooth random texture, shifted.
StereoObservation planeAt(int disparity) {
    cv::Mat texture(120, 300, CV_8UC1);
    cv::RNG rng(1);
    rng.fill(texture, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(texture, texture, {5, 5}, 1.0);
    StereoObservation o;
    o.camera = {
        .width = 200, .height = 120, .fx = 200, .fy = 200, .cx = 99.5, .cy = 59.5, .baseline = 0.1};
    o.left = texture.colRange(50, 250).clone();
    o.right = texture.colRange(50 + disparity, 250 + disparity).clone();
    return o;
}

template <class F>
std::string messageOf(F&& f) {
    try {
        f();
    } catch (const std::exception& e) {
        return e.what();
    }
    return {};
}

class EveryMatcher : public ::testing::TestWithParam<MatcherKind> {};

TEST_P(EveryMatcher, FindsAPlane) {
    StereoOptions options;
    options.matcher = GetParam();
    options.numDisparities = 32;
    ViewBuilder builder(options);
    const View view = builder.build(planeAt(20));
    const DisparityImage& d = view.disparity;
    EXPECT_EQ(d.firstColumn, 31);
    EXPECT_EQ(d.minDisparity, 0);
    EXPECT_EQ(d.maxDisparity, 31);
    int matched = 0;
    int right = 0;
    for (int r = 0; r < d.height; ++r) {
        for (int c = 0; c < d.width; ++c) {
            if (d.valid(c, r)) {
                ++matched;
                right += std::abs(d.at(c, r) - 20) < 0.5 ? 1 : 0;
                EXPECT_GT(d.sigma[d.index(c, r)], 0);
                EXPECT_GE(c, d.firstColumn);
            }
        }
    }
    EXPECT_GT(matched, (200 - 31) * 120 * 8 / 10);
    EXPECT_GE(right, matched * 995 / 1000);
}

TEST_P(EveryMatcher, TakesColourAndSixteenBit) {
    StereoOptions options;
    options.matcher = GetParam();
    options.numDisparities = 32;
    const auto matcher = makeStereoMatcher(options);
    const StereoObservation o = planeAt(7);
    DisparityImage grey, colour, deep;
    matcher->compute(o.left, o.right, grey);
    cv::Mat left, right;
    cv::cvtColor(o.left, left, cv::COLOR_GRAY2BGR);
    cv::cvtColor(o.right, right, cv::COLOR_GRAY2BGR);
    matcher->compute(left, right, colour);
    EXPECT_EQ(grey.disparity, colour.disparity);
    o.left.convertTo(left, CV_16U, 16);  // 12 bits in 16
    o.right.convertTo(right, CV_16U, 16);
    matcher->compute(left, right, deep);
    EXPECT_EQ(grey.disparity, deep.disparity);
    EXPECT_EQ(grey.sigma, deep.sigma);
}

TEST_P(EveryMatcher, RefusesWhatIsNoPair) {
    StereoOptions options;
    options.matcher = GetParam();
    const auto matcher = makeStereoMatcher(options);
    DisparityImage out;
    const cv::Mat a(20, 30, CV_8UC1, cv::Scalar(0)), b(20, 31, CV_8UC1, cv::Scalar(0));
    EXPECT_THAT(messageOf([&] { matcher->compute(a, b, out); }),
                AllOf(HasSubstr("30 x 20"), HasSubstr("31 x 20")));
    EXPECT_THAT(messageOf([&] { matcher->compute(a, {}, out); }),
                HasSubstr("right image is empty"));
    EXPECT_THAT(messageOf([&] { matcher->compute(cv::Mat(20, 30, CV_32FC1), a, out); }),
                HasSubstr("allowed: 8 or 16 bit"));
}

TEST_P(EveryMatcher, TakesImagesAboutAsWideAsItsRange) {
    cv::Mat noise(40, 320, CV_8UC1);
    cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 256);
    for (const auto& [first, range] :
         {std::pair(0, 3), std::pair(0, 16), std::pair(0, 18), std::pair(0, 96), std::pair(5, 16),
          std::pair(-10, 16), std::pair(-32, 16), std::pair(-40, 18)}) {
        StereoOptions options;
        options.matcher = GetParam();
        options.minDisparity = first;
        options.numDisparities = range;
        const auto matcher = makeStereoMatcher(options);
        const int reach = std::max(first + range - 1, 0);
        for (int width = 1; width <= reach + 60; ++width) {
            constexpr int kLeft = 60;
            const int right = kLeft + first + range / 2;
            DisparityImage out;
            matcher->compute(noise.colRange(kLeft, kLeft + width),
                             noise.colRange(right, right + width), out);
            ASSERT_EQ(out.width, width);
            int matched = 0;
            for (int r = 0; r < out.height; ++r) {
                for (int c = 0; c < width; ++c) {
                    EXPECT_FALSE(c < reach && out.valid(c, r))
                        << width << " x 40, " << range << " disparities from " << first;
                    matched += out.valid(c, r) ? 1 : 0;
                }
            }
            if (width == reach + 60) {
                EXPECT_GT(matched, 0) << range << " disparities from " << first;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Stereo, EveryMatcher,
                         ::testing::Values(MatcherKind::kPaper, MatcherKind::kOpenCvBlock,
                                           MatcherKind::kOpenCvSgbm));

TEST(ViewBuilder, TakesTheDisparityThatTheObservationBrings) {
    StereoOptions options;
    options.matcher = MatcherKind::kGiven;
    options.sigmaGiven = 0.25;
    ViewBuilder builder(options);
    StereoObservation o = planeAt(5);
    EXPECT_THAT(messageOf([&] { builder.build(o); }), HasSubstr("brings no disparity"));
    o.disparity.emplace();
    o.disparity->resize(200, 120);
    o.disparity->disparity[7] = 3.5F;
    o.disparity->disparity[8] = 4.5F;
    o.disparity->sigma[8] = 0.5F;
    const View view = builder.build(o);
    EXPECT_EQ(view.disparity.disparity, o.disparity->disparity);
    EXPECT_EQ(view.disparity.sigma[7], 0.25F);
    EXPECT_EQ(view.disparity.sigma[8], 0.5F);
    o.disparity->resize(100, 120);
    EXPECT_THAT(messageOf([&] { builder.build(o); }), HasSubstr("given disparity is 100 x 120"));
}

TEST(IsolatedFilter, DropsSmallGroupsOnly) {
    DisparityImage d;
    d.resize(6, 3);
    for (const std::size_t i : {0U, 1U, 6U, 4U}) {
        d.disparity[i] = 10.0F;
    }
    d.disparity[7] = 12.0F;  // beside a group, but at another depth
    IsolatedFilter().apply(d, 3, 1.0F);
    EXPECT_TRUE(d.valid(0, 0) && d.valid(1, 0) && d.valid(0, 1));
    EXPECT_FALSE(d.valid(4, 0) || d.valid(1, 1));
}

TEST(ViewBuilder, depthThatIsKnownTooBadlyIsNoSurface) {
    StereoObservation o = planeAt(20);
    o.disparity.emplace();
    o.disparity->resize(o.camera.width, o.camera.height);
    for (int c = 0; c < o.camera.width; ++c) {  // the first row: 1, 2, ... px; the rest unmatched
        o.disparity->disparity[o.disparity->index(c, 0)] = static_cast<float>(c + 1);
        o.disparity->sigma[o.disparity->index(c, 0)] = 0.1F;
    }
    StereoOptions options;
    const View all = ViewBuilder(options).build(o);
    EXPECT_EQ(all.disparity.sigma, o.disparity->sigma);
    options.maxDepthSigma = 0.05;
    const View view = ViewBuilder(options).build(o);
    EXPECT_EQ(view.disparity.disparity, o.disparity->disparity);
    int distrusted = 0;
    for (int c = 0; c < o.camera.width; ++c) {
        const float d = view.disparity.at(c, 0);
        const float sigma = view.disparity.sigma[view.disparity.index(c, 0)];
        // sigma_z = z^2 sigma_d / (f b), f b = 20: 5 cm at 10 m, 6.3 px.
        if (static_cast<double>(d) < std::sqrt(20 * 0.1 / 0.05) - 1e-3) {
            EXPECT_GT(3.0F * sigma, d);  // not known within a third of itself
            ++distrusted;
        } else {
            EXPECT_EQ(sigma, 0.1F);
        }
    }
    EXPECT_EQ(distrusted, 6);
}

}  // namespace
}  // namespace riftmap
