// SPDX-License-Identifier: BSD-3-Clause
// DisparityRefiner against its definition, step by step and in double precision, and the same bytes
// with every instruction set.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "riftmap/stereo/disparity_refiner.h"
#include "test_seed.h"

namespace riftmap {
namespace {

using Image = std::vector<double>;

struct Sample {
    cv::Mat left, right;
    DisparityImage matches;
};

/// Texture of some pixels, shifted by a slope with a step, and matches that are off.
Sample randomSample(std::mt19937_64& random) {
    const auto uniform = [&](double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(random);
    };
    Sample s;
    const int width = static_cast<int>(uniform(24, 70));
    const int height = static_cast<int>(uniform(5, 30));
    s.left.create(height, width, CV_8UC1);
    s.right.create(height, width, CV_8UC1);
    s.matches.resize(width, height);
    s.matches.maxDisparity = 12;
    const double edge = uniform(0, width);
    const double fx = uniform(0.3, 1.2), fy = uniform(-0.8, 0.8), gx = uniform(0.3, 1.2);
    const double slope = uniform(-0.05, 0.05);
    for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
            const double d = 6 + slope * row + (column < edge ? 4.0 : 0.0);
            const auto at = [&](double x) {
                return cv::saturate_cast<unsigned char>(120 + 40 * std::sin(fx * x + fy * row) +
                                                        30 * std::sin(gx * x - fy * row) +
                                                        uniform(-3, 3));
            };
            s.left.at<unsigned char>(row, column) = at(column);
            s.right.at<unsigned char>(row, column) = at(column + d);
            const std::size_t i = s.matches.index(column, row);
            s.matches.sigma[i] = static_cast<float>(uniform(0.1, 0.5));
            constexpr int kInside = 16;  // partners clear of the border: rounding decides there
            if (column >= kInside && uniform(0, 1) > 0.05) {
                s.matches.disparity[i] = static_cast<float>(d + uniform(-0.4, 0.4));
            }
        }
    }
    return s;
}

bool matched(double d) {
    return std::isfinite(d);
}

Image smoothed(const Image& d, int width, int height, double least, double most) {
    Image out = d;
    for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
            const double here = d[static_cast<std::size_t>(row * width + column)];
            std::vector<Eigen::Vector3d> terms;
            std::vector<double> values;
            for (int v = -3; v <= 3 && matched(here); ++v) {
                for (int u = -3; u <= 3; ++u) {
                    if (row + v < 0 || row + v >= height || column + u < 0 || column + u >= width) {
                        continue;
                    }
                    const double there =
                        d[static_cast<std::size_t>((row + v) * width + column + u)];
                    if (matched(there) && std::abs(there - here) <= 1.5) {
                        terms.emplace_back(1, u, v);
                        values.push_back(there);
                    }
                }
            }
            Eigen::MatrixXd system(static_cast<Eigen::Index>(terms.size()), 3);
            for (std::size_t k = 0; k < terms.size(); ++k) {
                system.row(static_cast<Eigen::Index>(k)) = terms[k];
            }
            if (terms.size() >= 6 && system.colPivHouseholderQr().rank() == 3) {
                const Eigen::Map<const Eigen::VectorXd> b(values.data(),
                                                          static_cast<Eigen::Index>(values.size()));
                out[static_cast<std::size_t>(row * width + column)] =
                    std::clamp(system.colPivHouseholderQr().solve(b)[0], least, most);
            }
        }
    }
    return out;
}

double spline(const unsigned char* row, double x) {
    const int i = static_cast<int>(std::floor(x));
    const double t = x - i;
    const double a = row[i - 1], b = row[i], c = row[i + 1], d = row[i + 2];
    return 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t * t +
                  (3 * b - 3 * c + d - a) * t * t * t);
}

/// One move of all pixels; the new sigma, too.
void moved(const Sample& s, Image& d, Image& sigma) {
    const int width = s.matches.width, height = s.matches.height;
    Image g(d.size()), e(d.size());
    std::vector<char> compared(d.size(), 0);
    for (int row = 0; row < height; ++row) {
        for (int column = 1; column < width - 1; ++column) {
            const auto i = static_cast<std::size_t>(row * width + column);
            const double x = column - d[i];
            if (!(x >= 2 && x < width - 3)) {
                continue;
            }
            const auto* l = s.left.ptr<unsigned char>(row);
            const auto* r = s.right.ptr<unsigned char>(row);
            compared[i] = 1;
            e[i] = l[column] - spline(r, x);
            g[i] = ((l[column + 1] - l[column - 1]) / 2.0 +
                    (spline(r, x + 1) - spline(r, x - 1)) / 2) /
                   2;
        }
    }
    for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
            const auto i = static_cast<std::size_t>(row * width + column);
            std::vector<std::size_t> window;
            for (int v = std::max(0, row - 3); v <= std::min(height - 1, row + 3); ++v) {
                for (int u = std::max(0, column - 3); u <= std::min(width - 1, column + 3); ++u) {
                    const auto k = static_cast<std::size_t>(v * width + u);
                    if (compared[k] != 0) {
                        window.push_back(k);
                    }
                }
            }
            if (compared[i] == 0 || window.size() < 10) {
                continue;
            }
            const auto n = static_cast<double>(window.size());
            double meanG = 0, meanE = 0, gg = 0, ge = 0, ee = 0;
            for (const std::size_t k : window) {
                meanG += g[k] / n;
                meanE += e[k] / n;
            }
            for (const std::size_t k : window) {
                gg += std::pow(g[k] - meanG, 2);
                ge += (g[k] - meanG) * (e[k] - meanE);
                ee += std::pow(e[k] - meanE, 2);
            }
            const double rest = std::max((ee - ge * ge / gg) / (n - 2), 1.0 / 6);
            const double prior = std::pow(static_cast<double>(s.matches.sigma[i]), 2);
            d[i] = std::clamp(d[i] + std::clamp(-ge / (gg + rest / prior), -0.5, 0.5),
                              static_cast<double>(s.matches.minDisparity),
                              static_cast<double>(s.matches.maxDisparity));
            sigma[i] = std::sqrt(1 / (1 / prior + gg / rest) + 0.2 * prior + 0.4 * prior * prior);
        }
    }
}

TEST(DisparityRefinerProperty, FollowsItsDefinition) {
    const std::uint64_t seed = seedOfRun();
    std::cout << "RIFTMAP_TEST_SEED=" << seed << "\n";
    std::mt19937_64 random(seed);
    for (int trial = 0; trial < 30; ++trial) {
        const Sample s = randomSample(random);
        const int iterations = 1 + trial % 2;
        DisparityImage found = s.matches;
        DisparityRefiner().apply(s.left, s.right, iterations, found);
        Image d(s.matches.disparity.begin(), s.matches.disparity.end());
        Image sigma(s.matches.sigma.begin(), s.matches.sigma.end());
        const auto smooth = [&] {
            d = smoothed(d, found.width, found.height, found.minDisparity, found.maxDisparity);
        };
        for (int k = 0; k < iterations; ++k) {
            smooth();
            moved(s, d, sigma);
        }
        smooth();
        int far = 0;
        for (std::size_t i = 0; i < d.size(); ++i) {
            ASSERT_EQ(matched(d[i]), found.disparity[i] < kNoDisparity);
            if (matched(d[i])) {
                far += std::abs(static_cast<double>(found.disparity[i]) - d[i]) > 2e-3 ? 1 : 0;
                far += std::abs(static_cast<double>(found.sigma[i]) - sigma[i]) > 2e-3 ? 1 : 0;
            }
        }
        // Where a disparity comes to lie 1.5 px from a neighbour's, rounding decides.
        EXPECT_LE(far, static_cast<int>(d.size()) / 200) << "trial " << trial;
    }
}

TEST(DisparityRefinerProperty, EveryTargetGivesTheSameBytes) {
    const std::uint64_t seed = seedOfRun();
    std::cout << "RIFTMAP_TEST_SEED=" << seed << "\n";
    std::mt19937_64 random(seed);
    for (int trial = 0; trial < 20; ++trial) {
        const Sample s = randomSample(random);
        DisparityImage first;
        for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
            hwy::SetSupportedTargetsForTest(target);
            DisparityImage found = s.matches;
            DisparityRefiner().apply(s.left, s.right, 2, found);
            if (first.disparity.empty()) {
                first = found;
            }
            EXPECT_EQ(found.disparity, first.disparity) << hwy::TargetName(target);
            EXPECT_EQ(found.sigma, first.sigma) << hwy::TargetName(target);
        }
        hwy::SetSupportedTargetsForTest(0);
    }
}

}  // namespace
}  // namespace riftmap
