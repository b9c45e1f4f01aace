// SPDX-License-Identifier: BSD-3-Clause

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "riftmap/core/parallel.h"
#include "riftmap/stereo/disparity_filters.h"

namespace riftmap {
namespace {

constexpr int kHoleReach = 3;     ///< [px]
constexpr int kSimilarReach = 2;  ///< [px]

}  // namespace

void RimFilter::measureTexture(const cv::Mat& grey, int texture) {
    const int width = grey.cols;
    flat_.resize(grey.total());
    sum_.resize(grey.total());
    parallelForEach(grey.rows, 16, [&](int row) {
        const std::uint8_t* rows[] = {grey.ptr(std::max(0, row - 1)), grey.ptr(row),
                                      grey.ptr(std::min(grey.rows - 1, row + 1))};
        const auto start = static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
        const auto at = [&](int c) {
            const int left = std::max(0, c - 1);
            const int right = std::min(width - 1, c + 1);
            int low = 255;
            int high = 0;
            int sum = 0;
            for (const auto* r : rows) {
                low = std::min({low, int{r[left]}, int{r[c]}, int{r[right]}});
                high = std::max({high, int{r[left]}, int{r[c]}, int{r[right]}});
                sum += r[left] + r[c] + r[right];
            }
            const auto i = start + static_cast<std::size_t>(c);
            flat_[i] = high - low <= texture ? 1 : 0;
            sum_[i] = static_cast<std::uint16_t>(sum);
        };
        for (int c = 0; c < width; ++c) {
            at(c);
        }
    });
}

void RimFilter::markBare(const DisparityImage& image) {
    bare_.resize(image.disparity.size());
    parallelForEach(image.height, 16, [&](int row) {
        std::uint8_t* bare = bare_.data() + image.index(0, row);
        const float* d = image.disparity.data() + image.index(0, row);
        for (int c = 0; c < image.width; ++c) {
            bare[c] = c >= image.firstColumn && !(d[c] < kNoDisparity) ? 1 : 0;
        }
    });
}

void RimFilter::apply(const cv::Mat& grey, int texture, DisparityImage& image) {
    if (texture <= 0 || image.width == 0) {
        return;
    }
    measureTexture(grey, texture);
    markBare(image);
    const int width = image.width;
    const auto forRowsNear = [&](int row, int reach, auto&& body) {
        for (int other = std::max(0, row - reach); other <= std::min(image.height - 1, row + reach);
             ++other) {
            body(image.index(0, other));
        }
    };
    beside_.resize(bare_.size());
    parallelForEach(image.height, 16, [&](int row) {
        const std::uint8_t* bare = bare_.data() + image.index(0, row);
        std::uint8_t* beside = beside_.data() + image.index(0, row);
        std::copy(bare, bare + width, beside);
        for (int k = 1; k <= std::min(kHoleReach, width - 1); ++k) {
            for (int c = 0; c < width - k; ++c) {
                beside[c] |= bare[c + k];
                beside[c + k] |= bare[c];
            }
        }
    });
    parallelForEach(image.height, 16, [&](int row) {
        float* d = image.disparity.data() + image.index(0, row);
        const std::uint8_t* flat = flat_.data() + image.index(0, row);
        forRowsNear(row, kHoleReach, [&](std::size_t other) {
            const std::uint8_t* beside = beside_.data() + other;
            for (int c = 0; c < width; ++c) {
                d[c] = (beside[c] & flat[c]) != 0 ? kNoDisparity : d[c];
            }
        });
    });
    markBare(image);
    parallelForEach(image.height, 16, [&](int row) {
        float* d = image.disparity.data() + image.index(0, row);
        const std::uint8_t* here = grey.ptr(row);
        forRowsNear(row, kSimilarReach, [&](std::size_t other) {
            for (int k = -kSimilarReach; k <= kSimilarReach; ++k) {
                for (int c = std::max(0, -k); c < width - std::max(0, k); ++c) {
                    const std::size_t q = other + static_cast<std::size_t>(c + k);
                    const bool similar = 2 * std::abs(9 * here[c] - sum_[q]) <= 9 * texture;
                    d[c] = (bare_[q] & flat_[q]) != 0 && similar ? kNoDisparity : d[c];
                }
            }
        });
    });
}

}  // namespace riftmap
