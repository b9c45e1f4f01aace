// SPDX-License-Identifier: BSD-3-Clause
// FacetFilter against its definition: least squares by a decomposition of each window's own system.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <optional>
#include <random>
#include <vector>

#include "riftmap/stereo/facet_filter.h"
#include "test_seed.h"

namespace riftmap {
namespace {

/// A facet around (column, row), seen from there: value at (column + u, row + v), its variance and
/// the residual for each degree of freedom.
struct Facet {
    double value, variance, residual;
    int freedom;
};

std::optional<Facet> facetAt(const DisparityImage& image, int column, int row, int radius,
                             bool quadratic, int u = 0, int v = 0) {
    const int side = 2 * radius + 1;
    const auto terms = [&](double x, double y) {
        Eigen::VectorXd t(quadratic ? 6 : 3);
        t.head<3>() << 1, x, y;
        if (quadratic) {
            t.tail<3>() << x * x, y * y, x * y;
        }
        return t;
    };
    Eigen::MatrixXd system(side * side, quadratic ? 6 : 3);
    Eigen::VectorXd values(side * side);
    for (int k = 0; k < side * side; ++k) {
        const int x = k % side - radius;
        const int y = k / side - radius;
        if (column + x < 0 || column + x >= image.width || row + y < 0 || row + y >= image.height ||
            !image.valid(column + x, row + y)) {
            return std::nullopt;
        }
        system.row(k) = terms(x, y);
        values[k] = static_cast<double>(image.at(column + x, row + y));
    }
    const Eigen::VectorXd solution = system.colPivHouseholderQr().solve(values);
    const Eigen::VectorXd at = terms(u, v);
    const Eigen::MatrixXd inverse = (system.transpose() * system).inverse();
    const int freedom = side * side - static_cast<int>(system.cols());
    return Facet{at.dot(solution), at.dot(inverse * at),
                 (values - system * solution).squaredNorm() / freedom, freedom};
}

struct Pixel {
    double disparity, sigma;
    bool sure = true;  ///< no test was so close that rounding may decide it
};

bool accepted(const Facet& f, double noise, Pixel& pixel) {
    const double limit = 1 + 2 * std::sqrt(2.0 / f.freedom);
    pixel.sure = pixel.sure && std::abs(f.residual / noise - limit) > 1e-4;
    return f.residual / noise < limit;
}

Pixel reference(const DisparityImage& image, int column, int row, int radius, double share) {
    const auto sigma = static_cast<double>(image.sigma[image.index(column, row)]);
    const double noise = share * sigma * sigma;
    Pixel pixel{static_cast<double>(image.at(column, row)), sigma};
    std::optional<Facet> best = facetAt(image, column, row, radius, true);
    if (best && !accepted(*best, noise, pixel)) {
        best.reset();
    }
    for (int v = -1; v <= 1 && !(best && best->freedom > 6); ++v) {
        for (int u = -1; u <= 1; ++u) {
            const auto f = facetAt(image, column + u, row + v, 1, false, -u, -v);
            if (f && accepted(*f, noise, pixel)) {
                const double less = best ? best->variance - f->variance : 1.0;
                if (less > 1e-9 || (less > -1e-9 && f->residual < best->residual)) {
                    best = f;
                }
            }
        }
    }
    if (best) {
        const double excess =
            std::max(0.0, best->residual / noise - 1 - std::sqrt(2.0 / best->freedom));
        if (best->variance + excess < 1) {
            pixel.disparity = std::clamp(best->value, static_cast<double>(image.minDisparity),
                                         static_cast<double>(image.maxDisparity));
            pixel.sigma = sigma * std::sqrt(share * (best->variance + excess) + 1 - share);
        }
    }
    return pixel;
}

/// As FacetFilter measures it: of every seventh pixel, the upper median.
double shareOf(const DisparityImage& image) {
    std::vector<double> ratios;
    for (int i = 0; i < image.width * image.height; i += 7) {
        const auto f = facetAt(image, i % image.width, i / image.width, 1, false);
        if (f) {
            ratios.push_back(
                f->residual /
                std::pow(static_cast<double>(image.sigma[static_cast<std::size_t>(i)]), 2));
        }
    }
    if (ratios.empty()) {
        return 0;
    }
    std::sort(ratios.begin(), ratios.end());
    return std::min(1.0, ratios[ratios.size() / 2] / (5.348 / 6));
}

/// Slopes, steps, bumps and holes, with noise that is smaller than sigma says or as large.
DisparityImage randomImage(std::mt19937_64& random) {
    const auto uniform = [&](double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(random);
    };
    DisparityImage image;
    image.resize(static_cast<int>(uniform(8, 40)), static_cast<int>(uniform(8, 30)));
    image.minDisparity = 1;
    image.maxDisparity = 96;
    const double edge = uniform(0, image.width);
    const double height = uniform(-4, 4);
    const double curve = uniform(-0.05, 0.05);
    const double real = uniform(0.4, 1.0);
    std::normal_distribution<double> normal(0.0, 1.0);
    for (int row = 0; row < image.height; ++row) {
        for (int column = 0; column < image.width; ++column) {
            const std::size_t i = image.index(column, row);
            const double sigma = column % 2 == 0 ? 0.2 : 0.3;
            image.sigma[i] = static_cast<float>(sigma);
            const double d = 30 + 0.3 * column - 0.2 * row + curve * row * row +
                             (column < edge ? height : 0.0) + real * sigma * normal(random);
            image.disparity[i] = uniform(0, 1) < 0.02 ? kNoDisparity : static_cast<float>(d);
        }
    }
    return image;
}

TEST(FacetFilterProperty, IsLeastSquaresOnTheWindowsThatPassTheTest) {
    const std::uint64_t seed = seedOfRun();
    std::cout << "RIFTMAP_TEST_SEED=" << seed << "\n";
    std::mt19937_64 random(seed);
    int moved = 0;
    for (int sample = 0; sample < 25; ++sample) {
        const DisparityImage image = randomImage(random);
        const int radius = 2 + sample % 3;
        DisparityImage filtered = image;
        FacetFilter().apply(filtered, radius);
        const double share = shareOf(image);
        if (std::abs(share - 0.1) < 1e-4) {
            continue;  // rounding decides whether anything is done
        }
        if (share < 0.1) {
            EXPECT_EQ(filtered.disparity, image.disparity) << "sample " << sample;
            EXPECT_EQ(filtered.sigma, image.sigma) << "sample " << sample;
            continue;
        }
        for (int row = 0; row < image.height; ++row) {
            for (int column = 0; column < image.width; ++column) {
                const std::size_t i = image.index(column, row);
                ASSERT_EQ(filtered.valid(column, row), image.valid(column, row));
                if (!image.valid(column, row)) {
                    continue;
                }
                const Pixel expected = reference(image, column, row, radius, share);
                if (expected.sure) {
                    EXPECT_NEAR(filtered.disparity[i], expected.disparity, 2e-4)
                        << "sample " << sample << ", " << column << ", " << row;
                    EXPECT_NEAR(filtered.sigma[i], expected.sigma, 2e-4)
                        << "sample " << sample << ", " << column << ", " << row;
                    moved += filtered.disparity[i] != image.disparity[i] ? 1 : 0;
                }
            }
        }
    }
    EXPECT_GT(moved, 2000);
}

}  // namespace
}  // namespace riftmap
