// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/facet_filter.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

namespace riftmap {
namespace {

constexpr int kWidth = 120, kHeight = 90;

/// A disparity image of a function of column and row, plus noise that is independent from pixel to
/// pixel.
DisparityImage imageOf(const std::function<double(int, int)>& truth, double sigma) {
    DisparityImage image;
    image.resize(kWidth, kHeight);
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0.0, 1.0);
    for (int row = 0; row < kHeight; ++row) {
        for (int column = 0; column < kWidth; ++column) {
            const std::size_t i = image.index(column, row);
            image.disparity[i] = static_cast<float>(truth(column, row) + sigma * noise(random));
            image.sigma[i] = static_cast<float>(sigma);
        }
    }
    return image;
}

double ball(int column, int row) {
    return 40.0 - 0.004 * (std::pow(column - 60.0, 2) + std::pow(row - 45.0, 2));
}

double step(int column, int /*row*/) {
    return column < 60 ? 40.0 : 36.0;
}

/// Of error and of error over sigma, where f(column, row) says that it counts.
struct Errors {
    double error = 0, overSigma = 0;
    int pixels = 0;
};

Errors errorsOf(
    const DisparityImage& image, const std::function<double(int, int)>& truth,
    const std::function<bool(int, int)>& counts = [](int, int) { return true; }) {
    Errors e;
    for (int row = 0; row < image.height; ++row) {
        for (int column = 0; column < image.width; ++column) {
            if (image.valid(column, row) && counts(column, row)) {
                const double off = static_cast<double>(image.at(column, row)) - truth(column, row);
                e.error += off * off;
                e.overSigma +=
                    std::pow(off / static_cast<double>(image.sigma[image.index(column, row)]), 2);
                ++e.pixels;
            }
        }
    }
    e.error = std::sqrt(e.error / e.pixels);
    e.overSigma = std::sqrt(e.overSigma / e.pixels);
    return e;
}

TEST(FacetFilter, TakesIndependentNoiseFromCurvedSurfaceAndSaysHowMuchIsLeft) {
    DisparityImage image = imageOf(ball, 0.25);
    FacetFilter().apply(image, 3);
    const Errors e = errorsOf(image, ball);
    EXPECT_LT(e.error, 0.25 * 0.4);
    EXPECT_GT(e.overSigma, 0.8);
    EXPECT_LT(e.overSigma, 1.25);
}

TEST(FacetFilter, KeepsStepsWhereTheyAre) {
    DisparityImage image = imageOf(step, 0.25);
    FacetFilter().apply(image, 3);
    const Errors beside =
        errorsOf(image, step, [](int column, int) { return column >= 57 && column < 63; });
    EXPECT_EQ(beside.pixels, 6 * kHeight);
    EXPECT_LT(beside.error, 0.25) << "smoothed on its own side";
    EXPECT_GT(beside.overSigma, 0.8);
    EXPECT_LT(beside.overSigma, 1.25);
}

TEST(FacetFilter, LeavesNoiseThatNeighboursHaveInCommon) {
    const DisparityImage fine = imageOf([](int, int) { return 0.0; }, 1.0);
    DisparityImage image = imageOf(ball, 0.25);
    constexpr int kReach = 5;
    for (int row = 0; row < kHeight; ++row) {
        for (int column = 0; column < kWidth; ++column) {
            double mean = 0;  // as a window of matching has it, of standard deviation 0.25
            for (int v = -kReach; v <= kReach; ++v) {
                for (int u = -kReach; u <= kReach; ++u) {
                    mean += static_cast<double>(
                        fine.at((column + u + kWidth) % kWidth, (row + v + kHeight) % kHeight));
                }
            }
            image.disparity[image.index(column, row)] =
                static_cast<float>(ball(column, row) + 0.25 * mean / (2 * kReach + 1));
        }
    }
    const DisparityImage before = image;
    FacetFilter().apply(image, 3);
    EXPECT_EQ(image.disparity, before.disparity);
    EXPECT_EQ(image.sigma, before.sigma);
}

TEST(FacetFilter, LeavesExactDepthAndIsOffAtRadiusZero) {
    for (const auto& [sigma, radius] : {std::pair(0.001, 3), std::pair(0.25, 0)}) {
        DisparityImage image = imageOf(ball, sigma);
        const DisparityImage before = image;
        FacetFilter().apply(image, radius);
        EXPECT_EQ(image.disparity, before.disparity) << sigma;
        EXPECT_EQ(image.sigma, before.sigma) << sigma;
    }
}

TEST(FacetFilter, FillsNothingAndLeavesOutliers) {
    DisparityImage image = imageOf(ball, 0.25);
    image.disparity[image.index(30, 30)] = kNoDisparity;
    image.disparity[image.index(80, 40)] += 20;
    const float outlier = image.at(80, 40);
    FacetFilter().apply(image, 3);
    EXPECT_FALSE(image.valid(30, 30));
    EXPECT_EQ(image.at(80, 40), outlier);
    EXPECT_NEAR(image.at(82, 42), ball(82, 42), 1.0) << "drawn towards it";
}

TEST(FacetFilter, StaysWithinTheRange) {
    DisparityImage image = imageOf([](int, int) { return 40.0; }, 0.25);
    image.maxDisparity = 40.05F;
    for (float& d : image.disparity) {
        d = std::min(d, image.maxDisparity);
    }
    FacetFilter().apply(image, 3);
    EXPECT_LE(*std::max_element(image.disparity.begin(), image.disparity.end()),
              image.maxDisparity);
}

TEST(FacetFilter, TakesImagesSmallerThanItsWindows) {
    for (const auto& [width, height] : {std::pair(0, 0), std::pair(2, 9), std::pair(5, 5)}) {
        DisparityImage image;
        image.resize(width, height);
        for (std::size_t i = 0; i < image.disparity.size(); ++i) {
            image.disparity[i] = 40.0F + 0.2F * static_cast<float>(i * 7 % 5);
            image.sigma[i] = 0.25F;
        }
        EXPECT_NO_THROW(FacetFilter().apply(image, 7));
    }
}

TEST(FacetFilter, GivesTheSameBytesForAnyNumberOfThreads) {
    std::vector<DisparityImage> results;
    for (const std::size_t threads : {1U, 2U, 5U}) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        results.push_back(imageOf(ball, 0.25));
        FacetFilter().apply(results.back(), 3);
        EXPECT_EQ(results.back().disparity, results.front().disparity);
        EXPECT_EQ(results.back().sigma, results.front().sigma);
    }
}

}  // namespace
}  // namespace riftmap
