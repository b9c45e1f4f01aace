// SPDX-License-Identifier: BSD-3-Clause
// PaperMatcher equals its slow reference bit for bit, whatever the image, options, threads and
// instruction set.
#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <opencv2/core.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "reference_matcher.h"
#include "riftmap/stereo/paper_matcher.h"
#include "test_seed.h"

namespace riftmap {
namespace {

struct Sample {
    cv::Mat left, right;
    StereoOptions options;
    std::string text;
};

/// A random pair: noise, blocks at random disparities, or few grey levels (many ties).
Sample randomSample(std::mt19937_64& random) {
    const auto upTo = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    const auto coin = [&] { return upTo(0, 1) == 1; };
    Sample s;
    const int width = upTo(0, 3) == 0 ? upTo(1, 12) : upTo(13, 110);
    const int height = upTo(0, 3) == 0 ? upTo(1, 6) : upTo(7, 40);
    const int levels = coin() ? 255 : upTo(1, 8);
    const int darkest = coin() ? 0 : 20;  // noise is measured away from black and white
    const int brightest = darkest > 0 ? 230 : 255;
    s.left.create(height, width, CV_8UC1);
    s.right.create(height, width, CV_8UC1);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            s.left.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(
                darkest + upTo(0, levels) * (brightest - darkest) / levels);
        }
    }
    const int shift = upTo(0, 40);
    const int noise = upTo(0, 6);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const int from = x + shift / (1 + (y / 8 + x / 24) % 3);
            const int v = from < width ? s.left.at<std::uint8_t>(y, from) : upTo(0, 255);
            s.right.at<std::uint8_t>(y, x) =
                static_cast<std::uint8_t>(std::clamp(v + upTo(-noise, noise), 0, 255));
        }
    }
    StereoOptions& o = s.options;
    o.window = 2 * upTo(1, 10) + 1;
    o.numDisparities = coin() ? upTo(1, 40) : upTo(41, 100);
    o.minDisparity = upTo(0, 2) == 0 ? upTo(-30, 30) : 0;
    o.prefilter = static_cast<Prefilter>(upTo(0, 2));
    o.prefilterGain = upTo(1, 6);
    o.prefilterCap = upTo(1, 127);
    o.truncation = upTo(1, 127);
    o.supportingWindows = coin();
    o.semiGlobal = coin();
    o.penaltySmall = upTo(0, 20) * 0.25;
    o.penaltyLarge = o.penaltySmall + upTo(0, 40) * 0.25;
    o.guard = coin() ? upTo(0, 60) : 0;
    o.leftRightCheck = coin();
    o.leftRightTolerance = upTo(0, 3);
    o.uniqueness = upTo(0, 20);
    o.uniquenessMargin = coin() ? 0 : upTo(0, 8) * 0.125;
    o.sharpness = coin() ? 0 : upTo(0, 8) * 0.25;
    o.subpixel = upTo(0, 4) != 0;
    o.isolatedSize = coin() ? 0 : upTo(1, 60);
    o.isolatedDifference = upTo(0, 8) * 0.25;
    o.anchorReach = upTo(0, 12);
    o.anchorMargin = upTo(0, 8) * 0.25;
    o.rimTexture = coin() ? 0 : upTo(1, 160);
    o.silhouetteReach = upTo(0, 4);
    o.silhouetteRows = upTo(0, 5);
    o.imageNoise = coin() ? 0 : upTo(1, 40) * 0.25;
    o.sigmaNoise = upTo(0, 8) * 0.5;
    o.sigmaMismatch = upTo(0, 8) * 0.1;
    o.sigmaSlope = coin() ? 0 : upTo(1, 8) * 0.2;
    o.silhouetteStep = upTo(2, 8) * 0.5;
    OptionTable table;
    o.describe(table);
    s.text = std::to_string(width) + " x " + std::to_string(height) + "\n" + table.dump();
    return s;
}

bool sameBits(const std::vector<float>& a, const std::vector<float>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float x, float y) {
        return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
    });
}

std::string firstDifference(const DisparityImage& a, const DisparityImage& b) {
    std::ostringstream out;
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            const auto i = a.index(x, y);
            if (std::bit_cast<std::uint32_t>(a.disparity[i]) !=
                    std::bit_cast<std::uint32_t>(b.disparity[i]) ||
                (a.valid(x, y) && a.sigma[i] != b.sigma[i])) {
                out << "at (" << x << ", " << y << "): " << a.disparity[i] << " sigma "
                    << a.sigma[i] << " against " << b.disparity[i] << " sigma " << b.sigma[i];
                return out.str();
            }
        }
    }
    return {};
}

TEST(PaperMatcherProperty, EqualsTheReferenceForAnyThreadsAndTargets) {
    const std::uint64_t seed = seedOfRun();
    std::cout << "RIFTMAP_TEST_SEED=" << seed << "\n";
    std::mt19937_64 random(seed);
    std::vector<std::int64_t> targets;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        targets.push_back(target);
    }
    ASSERT_FALSE(targets.empty());
    std::size_t matched = 0;
    for (int trial = 0; trial < 400; ++trial) {
        const Sample s = randomSample(random);
        const DisparityImage expected = reference::match(s.left, s.right, s.options);
        matched += static_cast<std::size_t>(
            std::count_if(expected.disparity.begin(), expected.disparity.end(),
                          [](float d) { return std::isfinite(d); }));
        PaperMatcher matcher(s.options);
        const std::int64_t target = targets[static_cast<std::size_t>(trial) % targets.size()];
        hwy::SetSupportedTargetsForTest(target);
        for (const int threads : {1, 2, 3}) {
            tbb::task_arena arena(threads);
            DisparityImage found;
            arena.execute([&] { matcher.compute(s.left, s.right, found); });
            ASSERT_EQ(firstDifference(found, expected), "")
                << "trial " << trial << ", threads " << threads << ", target "
                << hwy::TargetName(target) << ", " << s.text;
        }
        hwy::SetSupportedTargetsForTest(0);
    }
    EXPECT_GT(matched, 10000U) << "the samples hardly match anything: the test says little";
}

TEST(PaperMatcherProperty, EveryTargetGivesTheSameBytes) {
    const std::uint64_t seed = seedOfRun();
    std::cout << "RIFTMAP_TEST_SEED=" << seed << "\n";
    std::mt19937_64 random(seed);
    for (int trial = 0; trial < 40; ++trial) {
        const Sample s = randomSample(random);
        PaperMatcher matcher(s.options);
        DisparityImage first;
        for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
            hwy::SetSupportedTargetsForTest(target);
            DisparityImage found;
            matcher.compute(s.left, s.right, found);
            if (first.disparity.empty()) {
                first = found;
            }
            EXPECT_TRUE(sameBits(found.disparity, first.disparity) &&
                        sameBits(found.sigma, first.sigma))
                << hwy::TargetName(target) << ", " << s.text;
        }
        hwy::SetSupportedTargetsForTest(0);
    }
}

}  // namespace
}  // namespace riftmap
