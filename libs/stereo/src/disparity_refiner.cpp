// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/disparity_refiner.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "filter_kernel.h"
#include "riftmap/core/parallel.h"

namespace riftmap {

namespace {

constexpr int kReach = kernel::kPlaneReach;  // of the window, too [px]
constexpr float kOneSurface = 1.5F;          // [px]
constexpr std::size_t kRows = 8;             // of one task

/// Catmull and Rom's spline through four samples, t of the way from the second to the third.
float between(const std::array<float, 4>& p, float t) {
    return p[1] + 0.5F * t *
                      (p[2] - p[0] +
                       t * (2 * p[0] - 5 * p[1] + 4 * p[2] - p[3] +
                            t * (3 * (p[1] - p[2]) + p[3] - p[0])));
}

/// The rows within kReach of a row that the image has.
struct RowsAround {
    RowsAround(int row, int height)
        : first(std::max(-kReach, -row)), count(std::min(kReach, height - 1 - row) - first + 1) {}
    int first;  ///< of them, from the row itself
    int count;
};

}  // namespace

void DisparityRefiner::smooth(DisparityImage& image) {
    const auto width = static_cast<std::size_t>(image.width);
    const std::size_t stride = width + kernel::kPlaneRoom;
    padded_.assign(stride * static_cast<std::size_t>(image.height), kNoDisparity);
    const auto paddedRow = [&](int row) {
        return padded_.data() + static_cast<std::size_t>(row) * stride;
    };
    parallelForEach(image.height, kRows, [&](int row) {
        std::copy_n(image.disparity.data() + image.index(0, row), width, paddedRow(row) + kReach);
    });
    parallelForEach(image.height, kRows, [&](int row) {
        std::array<const float*, 2 * kReach + 1> rows{};
        const auto [first, count] = RowsAround(row, image.height);
        for (int k = 0; k < count; ++k) {
            rows[static_cast<std::size_t>(k)] = paddedRow(row + first + k);
        }
        float* const out = image.disparity.data() + image.index(0, row);
        kernel::planeMiddles(rows.data(), count, first, width, kOneSurface, out);
        for (std::size_t c = 0; c < width; ++c) {
            out[c] = out[c] < kNoDisparity
                         ? std::clamp(out[c], image.minDisparity, image.maxDisparity)
                         : kNoDisparity;
        }
    });
}

void DisparityRefiner::warp(const cv::Mat& left, const cv::Mat& right,
                            const DisparityImage& image) {
    for (auto* plane : {&compared_, &gradient_, &difference_}) {
        plane->assign(image.disparity.size(), 0.0F);
    }
    parallelForEach(image.height, kRows, [&](int row) {
        const unsigned char* l = left.ptr<unsigned char>(row);
        const unsigned char* r = right.ptr<unsigned char>(row);
        for (int column = 1; column < image.width - 1; ++column) {
            const std::size_t i = image.index(column, row);
            const float x = static_cast<float>(column) - image.disparity[i];
            if (!(x >= 2.0F && x < static_cast<float>(image.width - 3))) {
                continue;  // no partner, or no match
            }
            const auto first = static_cast<int>(x);
            const float t = x - static_cast<float>(first);
            const auto sample = [&](int from) {
                return between({static_cast<float>(r[from - 1]), static_cast<float>(r[from]),
                                static_cast<float>(r[from + 1]), static_cast<float>(r[from + 2])},
                               t);
            };
            const float ofRight = sample(first + 1) - sample(first - 1);
            const auto ofLeft = static_cast<float>(l[column + 1] - l[column - 1]);
            compared_[i] = 1;
            gradient_[i] = 0.25F * (ofLeft + ofRight);
            difference_[i] = static_cast<float>(l[column]) - sample(first);
        }
    });
}

void DisparityRefiner::move(DisparityImage& image) {
    const auto width = static_cast<std::size_t>(image.width);
    parallelFor(static_cast<std::size_t>(image.height), kRows,
                [&](std::size_t begin, std::size_t end) {
                    std::vector<float> scratch(6 * (width + kernel::kPlaneRoom), 0.0F);
                    for (auto row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
                        std::array<kernel::ComparedRow, 2 * kReach + 1> rows{};
                        const auto [first, count] = RowsAround(row, image.height);
                        for (int k = 0; k < count; ++k) {
                            const std::size_t start = image.index(0, row + first + k);
                            rows.at(static_cast<std::size_t>(k)) = {compared_.data() + start,
                                                                    gradient_.data() + start,
                                                                    difference_.data() + start};
                        }
                        const std::size_t start = image.index(0, row);
                        kernel::moveRow(rows.data(), count, -first, width, matched_.data() + start,
                                        image.minDisparity, image.maxDisparity, scratch.data(),
                                        image.disparity.data() + start, image.sigma.data() + start);
                    }
                });
}

void DisparityRefiner::apply(const cv::Mat& left, const cv::Mat& right, int iterations,
                             DisparityImage& image) {
    for (const cv::Mat* m : {&left, &right}) {
        if (m->type() != CV_8UC1 || m->cols != image.width || m->rows != image.height) {
            throw std::invalid_argument("refining takes 8-bit grey images of the disparity's size");
        }
    }
    if (iterations <= 0) {
        return;
    }
    matched_ = image.sigma;
    for (int i = 0; i < iterations; ++i) {
        smooth(image);
        warp(left, right, image);
        move(image);
    }
    smooth(image);
}

}  // namespace riftmap
