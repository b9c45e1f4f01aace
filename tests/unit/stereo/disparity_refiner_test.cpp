// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/disparity_refiner.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <random>
#include <stdexcept>

#include "riftmap/stereo/stereo_matcher.h"

namespace riftmap {
namespace {

constexpr int kWidth = 160, kHeight = 90;

/// A texture that is known everywhere: waves of some 5 px and more.
double textureAt(double x, double y) {
    double sum = 0;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1.2, 1.2);
    for (int wave = 0; wave < 12; ++wave) {
        const double fx = uniform(random);
        const double fy = uniform(random);
        sum += std::sin(fx * x + fy * y + 3 * uniform(random));
    }
    return 127 + 20 * sum;
}

using Function = std::function<double(double, double)>;

/// A pair that shows a surface of this disparity (of column and row of the left image) and matches
/// that are off by what neighbours have in common, as a matcher's are.
struct Pair {
    explicit Pair(const Function& d, double off = 0.25, double brighter = 0)
        : left(kHeight, kWidth, CV_8UC1), right(left.clone()), truth(d) {
        const auto sampled = [](double value) { return cv::saturate_cast<unsigned char>(value); };
        matches.resize(kWidth, kHeight);
        matches.maxDisparity = 64;
        for (int row = 0; row < kHeight; ++row) {
            for (int column = 0; column < kWidth; ++column) {
                left.at<unsigned char>(row, column) = sampled(textureAt(column, row));
                double x = column;  // of the left image, seen at `column` of the right one
                for (int i = 0; i < 60; ++i) {
                    x = column + d(x, row);
                }
                right.at<unsigned char>(row, column) = sampled(textureAt(x, row) + brighter);
                const std::size_t i = matches.index(column, row);
                const double error = off * std::sin(column / 7.0) * std::cos(row / 9.0) * 1.4;
                if (column >= 50) {
                    matches.disparity[i] = static_cast<float>(d(column, row) + error);
                    matches.sigma[i] = 0.25F;
                }
            }
        }
    }
    /// Root mean square error away from the borders, where f(column) says so.
    double error(const std::function<bool(int)>& counts = [](int) { return true; }) const {
        double sum = 0;
        int n = 0;
        for (int row = 8; row < kHeight - 8; ++row) {
            for (int column = 60; column < kWidth - 8; ++column) {
                if (counts(column)) {
                    sum += std::pow(
                        static_cast<double>(matches.at(column, row)) - truth(column, row), 2);
                    ++n;
                }
            }
        }
        return std::sqrt(sum / n);
    }
    cv::Mat left, right;
    Function truth;
    DisparityImage matches;
};

double slope(double x, double y) {
    return 20 + 0.08 * x - 0.05 * y;
}

TEST(DisparityRefiner, FindsASlopeThatMatchingMissed) {
    Pair pair(slope);
    ASSERT_GT(pair.error(), 0.15);
    DisparityRefiner().apply(pair.left, pair.right, 2, pair.matches);
    EXPECT_LT(pair.error(), 0.04);
    const float sigma = pair.matches.sigma[pair.matches.index(100, 40)];
    EXPECT_LT(sigma, 0.25F * 0.6F);
}

TEST(DisparityRefiner, IsNotMisledByLight) {
    Pair pair(slope, 0.25, 25);
    DisparityRefiner().apply(pair.left, pair.right, 2, pair.matches);
    EXPECT_LT(pair.error(), 0.06);
}

TEST(DisparityRefiner, KeepsStepsWhereTheyAre) {
    Pair pair([](double x, double) { return x < 100 ? 24.0 : 20.0; });
    DisparityRefiner().apply(pair.left, pair.right, 2, pair.matches);
    const auto beside = [](int column) { return column >= 97 && column < 103; };
    EXPECT_LT(pair.error(beside), 0.5);
    EXPECT_LT(pair.error([&](int column) { return std::abs(column - 100) > 8; }), 0.04);
}

TEST(DisparityRefiner, LeavesTheMatcherItsSayWithoutTexture) {
    Pair pair([](double, double) { return 20.0; });
    pair.left = 127;
    pair.right = 130;
    DisparityRefiner().apply(pair.left, pair.right, 2, pair.matches);
    EXPECT_GT(pair.error(), 0.1) << "nothing says where it is";
    EXPECT_LT(pair.error(), 0.3);
    EXPECT_GT(pair.matches.sigma[pair.matches.index(100, 40)], 0.25F);
}

TEST(DisparityRefiner, FillsNothingAndStaysWithinTheRange) {
    Pair pair(slope);
    pair.matches.disparity[pair.matches.index(90, 40)] = kNoDisparity;
    pair.matches.maxDisparity = 27;
    for (float& d : pair.matches.disparity) {
        d = d < kNoDisparity ? std::min(d, 27.0F) : d;
    }
    DisparityRefiner().apply(pair.left, pair.right, 2, pair.matches);
    EXPECT_FALSE(pair.matches.valid(90, 40));
    EXPECT_FALSE(pair.matches.valid(20, 40));
    for (const float d : pair.matches.disparity) {
        EXPECT_TRUE(d <= 27.0F || d == kNoDisparity);
    }
}

TEST(DisparityRefiner, DoesNothingWithoutIterations) {
    Pair pair(slope);
    const DisparityImage before = pair.matches;
    DisparityRefiner().apply(pair.left, pair.right, 0, pair.matches);
    EXPECT_EQ(pair.matches.disparity, before.disparity);
    EXPECT_EQ(pair.matches.sigma, before.sigma);
}

TEST(DisparityRefiner, TakesGreyImagesOfTheDisparitysSizeOnly) {
    Pair pair(slope);
    DisparityRefiner refiner;
    const cv::Mat narrow = pair.right.colRange(0, 100).clone();
    cv::Mat colour(kHeight, kWidth, CV_8UC3);
    EXPECT_THROW(refiner.apply(pair.left, narrow, 2, pair.matches), std::invalid_argument);
    EXPECT_THROW(refiner.apply(colour, pair.right, 2, pair.matches), std::invalid_argument);
}

TEST(DisparityRefiner, TakesImagesOfAnySize) {
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(3, 40), std::pair(9, 2)}) {
        DisparityImage image;
        image.resize(width, height);
        std::fill(image.disparity.begin(), image.disparity.end(), 1.0F);
        std::fill(image.sigma.begin(), image.sigma.end(), 0.25F);
        const cv::Mat grey(height, width, CV_8UC1, cv::Scalar(100));
        EXPECT_NO_THROW(DisparityRefiner().apply(grey, grey, 2, image));
        EXPECT_EQ(image.disparity.front(), 1.0F);
    }
}

TEST(DisparityRefiner, GivesTheSameBytesForAnyNumberOfThreads) {
    std::array<DisparityImage, 3> results;
    for (std::size_t k = 0; k < results.size(); ++k) {
        Pair pair(slope);
        tbb::task_arena arena(static_cast<int>(k) + 1);
        arena.execute([&] { DisparityRefiner().apply(pair.left, pair.right, 2, pair.matches); });
        results.at(k) = pair.matches;
        EXPECT_EQ(results.at(k).disparity, results.front().disparity);
        EXPECT_EQ(results.at(k).sigma, results.front().sigma);
    }
}

TEST(DisparityRefiner, RunsAfterAnyMatcher) {
    const Pair pair(slope);
    for (const auto kind :
         {MatcherKind::kPaper, MatcherKind::kOpenCvBlock, MatcherKind::kOpenCvSgbm}) {
        std::array<double, 2> errors{};
        for (const int iterations : {0, 2}) {
            StereoOptions options;
            options.matcher = kind;
            options.refine = iterations;
            DisparityImage found;
            makeStereoMatcher(options)->compute(pair.left, pair.right, found);
            double sum = 0;
            int n = 0;
            for (int row = 10; row < kHeight - 10; ++row) {
                for (int column = 70; column < kWidth - 10; ++column) {
                    const double e =
                        static_cast<double>(found.at(column, row)) - slope(column, row);
                    if (std::abs(e) < 1) {
                        sum += e * e;
                        ++n;
                    }
                }
            }
            EXPECT_GT(n, 1000);
            errors.at(iterations > 0 ? 1 : 0) = std::sqrt(sum / n);
        }
        EXPECT_LT(errors[1], 0.8 * errors[0]) << static_cast<int>(kind);
    }
}

}  // namespace
}  // namespace riftmap
