// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/facet_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "riftmap/core/parallel.h"

namespace riftmap {

namespace {

constexpr float kNoFacet = std::numeric_limits<float>::infinity();
constexpr float kExact = 0.01F;      // [px]
constexpr double kLeastShare = 0.1;  // of independent noise
constexpr std::size_t kRows = 8;     // of one task

/// The basis 1, u, v, u^2 - m, v^2 - m, u v over a full window, where it is orthogonal; m is the
/// mean of u^2. Sums of its squares.
struct Basis {
    explicit Basis(int windowRadius) : radius(windowRadius) {
        double ofRow = 0;
        for (int u = -radius; u <= radius; ++u) {
            ofRow += square(u) * square(u);
        }
        ofLinear = pixels * meanSquare;
        ofSquare = side * ofRow;
        ofMixed = pixels * meanSquare * meanSquare;
    }
    double square(int u) const { return u * u - meanSquare; }

    int radius;
    int side = 2 * radius + 1;
    int pixels = side * side;
    double meanSquare = radius * (radius + 1) / 3.0;
    double ofLinear, ofSquare, ofMixed;
};

/// Products of the disparities with the basis, over the rows of a window, for every column.
struct ColumnSums {
    explicit ColumnSums(int width)
        : plain(static_cast<std::size_t>(width)),
          linear(plain.size()),
          quadratic(plain.size()),
          squares(plain.size()),
          matched(plain.size()) {}

    void make(const DisparityImage& image, int middle, const Basis& basis) {
        for (auto* sums : {&plain, &linear, &quadratic, &squares}) {
            std::fill(sums->begin(), sums->end(), 0.0);
        }
        std::fill(matched.begin(), matched.end(), 0);
        for (int v = -basis.radius; v <= basis.radius; ++v) {
            const float* d = image.disparity.data() + image.index(0, middle + v);
            for (std::size_t c = 0; c < plain.size(); ++c) {
                const bool valid = d[c] < kNoDisparity;
                const double x = valid ? static_cast<double>(d[c]) : 0.0;
                plain[c] += x;
                linear[c] += v * x;
                quadratic[c] += basis.square(v) * x;
                squares[c] += x * x;
                matched[c] += valid ? 1 : 0;
            }
        }
    }

    std::vector<double> plain, linear, quadratic, squares;
    std::vector<int> matched;
};

/// The same over the whole window that begins at column `first`.
struct WindowSums {
    WindowSums(const ColumnSums& sums, std::size_t first, const Basis& basis) {
        for (int k = 0; k < basis.side; ++k) {
            const std::size_t c = first + static_cast<std::size_t>(k);
            const int x = k - basis.radius;
            one += sums.plain[c];
            u += x * sums.plain[c];
            v += sums.linear[c];
            uu += basis.square(x) * sums.plain[c];
            vv += sums.quadratic[c];
            uv += x * sums.linear[c];
            squares += sums.squares[c];
        }
    }
    double one = 0, u = 0, v = 0, uu = 0, vv = 0, uv = 0, squares = 0;
};

/// Standard deviation of the mean square of residuals, of its mean.
double spread(int freedom) {
    return std::sqrt(2.0 / freedom);
}

/// Whether residuals whose mean square is `ratio` times the expected one may be noise alone.
bool mayBeFacet(double ratio, int freedom) {
    return ratio < 1 + 2 * spread(freedom);
}

double excess(double ratio, int freedom) {
    return std::max(0.0, ratio - 1 - spread(freedom));
}

}  // namespace

struct FacetFilter::Smoothed {
    float disparity = kNoDisparity;
    double variance = 1;  ///< of that of a pixel's independent noise
};

void FacetFilter::fit(const DisparityImage& image, int radius, bool quadratic, Facets& facets) {
    const Basis basis(radius);
    facets.freedom = basis.pixels - (quadratic ? 6 : 3);
    facets.inMiddle = 1.0 / basis.pixels +
                      (quadratic ? 2 * basis.meanSquare * basis.meanSquare / basis.ofSquare : 0.0);
    const std::size_t pixels = image.disparity.size();
    facets.residual.assign(pixels, kNoFacet);
    facets.value.resize(pixels);
    facets.column.resize(quadratic ? 0 : pixels);
    facets.row.resize(quadratic ? 0 : pixels);
    const auto fitRow = [&](int row, ColumnSums& sums) {
        sums.make(image, row, basis);
        int matched = 0;
        for (int c = 0; c < basis.side - 1; ++c) {
            matched += sums.matched[static_cast<std::size_t>(c)];
        }
        for (int column = radius; column < image.width - radius; ++column) {
            const auto first = static_cast<std::size_t>(column - radius);
            matched += sums.matched[first + static_cast<std::size_t>(basis.side) - 1];
            const bool full = matched == basis.pixels;
            matched -= sums.matched[first];
            if (!full) {
                continue;
            }
            const WindowSums s(sums, first, basis);
            const std::size_t i = image.index(column, row);
            double rest =
                s.squares - s.one * s.one / basis.pixels - (s.u * s.u + s.v * s.v) / basis.ofLinear;
            double value = s.one / basis.pixels;
            if (quadratic) {
                rest -= (s.uu * s.uu + s.vv * s.vv) / basis.ofSquare + s.uv * s.uv / basis.ofMixed;
                value -= basis.meanSquare * (s.uu + s.vv) / basis.ofSquare;
            } else {
                facets.column[i] = static_cast<float>(s.u / basis.ofLinear);
                facets.row[i] = static_cast<float>(s.v / basis.ofLinear);
            }
            facets.value[i] = static_cast<float>(value);
            facets.residual[i] = static_cast<float>(std::max(rest, 0.0) / facets.freedom);
        }
    };
    if (image.height < basis.side || image.width < basis.side) {
        return;
    }
    const int rows = image.height - basis.side + 1;
    parallelFor(static_cast<std::size_t>(rows), kRows, [&](std::size_t begin, std::size_t end) {
        ColumnSums sums(image.width);
        for (std::size_t r = begin; r < end; ++r) {
            fitRow(static_cast<int>(r) + radius, sums);
        }
    });
}

/// Share of the variance that neighbours do not have in common, at most 1.
double FacetFilter::independentShare(const DisparityImage& image) const {
    constexpr double kMedian = 5.348 / 6;  // of chi squared with 6 degrees of freedom, of its mean
    std::vector<float> ratios;
    for (std::size_t i = 0; i < planes_.residual.size(); i += 7) {
        if (planes_.residual[i] < kNoFacet && image.sigma[i] > kExact) {
            ratios.push_back(planes_.residual[i] / (image.sigma[i] * image.sigma[i]));
        }
    }
    if (ratios.empty()) {
        return 0;
    }
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    return std::min(1.0, static_cast<double>(*middle) / kMedian);
}

/// On the plane that leaves the least variance; of several such, the one that fits best.
FacetFilter::Smoothed FacetFilter::onPlane(const DisparityImage& image, int column, int row,
                                           double noise) const {
    const Basis basis(1);
    Smoothed best;
    double leastVariance = 0, leastRatio = 0;
    for (int v = -1; v <= 1; ++v) {
        for (int u = -1; u <= 1; ++u) {
            if (column + u < 0 || column + u >= image.width || row + v < 0 ||
                row + v >= image.height) {
                continue;
            }
            const std::size_t i = image.index(column + u, row + v);
            const double ratio = static_cast<double>(planes_.residual[i]) / noise;
            const double variance = planes_.inMiddle + (u * u + v * v) / basis.ofLinear;
            if (mayBeFacet(ratio, planes_.freedom) &&
                (best.disparity == kNoDisparity || variance < leastVariance ||
                 (variance == leastVariance && ratio < leastRatio))) {
                leastVariance = variance;
                leastRatio = ratio;
                best.disparity = planes_.value[i] - static_cast<float>(u) * planes_.column[i] -
                                 static_cast<float>(v) * planes_.row[i];
                best.variance = variance + excess(ratio, planes_.freedom);
            }
        }
    }
    return best;
}

FacetFilter::Smoothed FacetFilter::smoothed(const DisparityImage& image, int column, int row,
                                            double noise) const {
    const std::size_t i = image.index(column, row);
    const double ratio = static_cast<double>(quadratics_.residual[i]) / noise;
    if (mayBeFacet(ratio, quadratics_.freedom)) {
        return {quadratics_.value[i], quadratics_.inMiddle + excess(ratio, quadratics_.freedom)};
    }
    return onPlane(image, column, row, noise);
}

void FacetFilter::apply(DisparityImage& image, int radius) {
    const auto noisy = [](float sigma) { return sigma > kExact; };
    if (radius <= 0 || std::none_of(image.sigma.begin(), image.sigma.end(), noisy)) {
        return;
    }
    fit(image, 1, false, planes_);
    const double share = independentShare(image);
    if (share < kLeastShare) {
        return;
    }
    fit(image, radius, true, quadratics_);
    parallelForEach(image.height, kRows, [&](int row) {
        for (int column = 0; column < image.width; ++column) {
            const std::size_t i = image.index(column, row);
            if (!image.valid(column, row) || image.sigma[i] <= kExact) {
                continue;
            }
            const double variance = std::pow(static_cast<double>(image.sigma[i]), 2);
            const Smoothed s = smoothed(image, column, row, share * variance);
            if (s.variance < 1) {
                image.disparity[i] =
                    std::clamp(s.disparity, image.minDisparity, image.maxDisparity);
                image.sigma[i] =
                    static_cast<float>(std::sqrt(variance * (share * s.variance + 1 - share)));
            }
        }
    });
}

}  // namespace riftmap
