// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/paper_matcher.h"

#include <hwy/aligned_allocator.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <vector>

#include "match_kernel.h"
#include "riftmap/stereo/grey.h"
#include "riftmap/stereo/isolated.h"

namespace riftmap {
namespace {

/// The window is cut into small windows: one in the centre, four supporting ones at its corners.
struct WindowLayout {
    int half;    ///< of the small windows [px]
    int offset;  ///< of the supporting windows [px]
};

WindowLayout layoutOf(const StereoOptions& options) {
    const int offset = options.supportingWindows ? (options.window + 1) / 4 : 0;
    return {.half = (options.window - 2 * offset) / 2, .offset = offset};
}

kernel::Filter filterOf(Prefilter prefilter) {
    switch (prefilter) {
        case Prefilter::kDog:
            return kernel::Filter::kDog;
        case Prefilter::kGradient:
            return kernel::Filter::kGradient;
        case Prefilter::kNone:
            break;
    }
    return kernel::Filter::kNone;
}

/// Numbers, aligned for every instruction set, grown and never shrunk.
template <class T>
class AlignedBuffer {
 public:
    T* get(std::size_t n) {
        if (n > size_) {
            data_ = hwy::AllocateAligned<T>(n);
            size_ = n;
        }
        return data_.get();
    }

 private:
    hwy::AlignedFreeUniquePtr<T[]> data_;
    std::size_t size_ = 0;
};

/// Turns the minima of a row into disparities and their sigma.
class RowFinisher {
 public:
    RowFinisher(const StereoOptions& options, const kernel::MatchJob& job, DisparityImage& out)
        : options_(options), job_(job), out_(out) {
        const auto side = static_cast<float>(2 * job.halfWindow + 1);
        pixels_ = side * side * (job.supportOffset > 0 ? 3.0F : 1.0F);
    }

    void operator()(int row, const kernel::RowResult& r) const {
        for (int c = out_.firstColumn; c < out_.width; ++c) {
            const auto x = static_cast<std::size_t>(c);
            if (accepted(r, x)) {
                write(out_.index(c, row), r, x);
            }
        }
    }

 private:
    bool accepted(const kernel::RowResult& r, std::size_t x) const {
        const int index = r.bestIndex[x];
        // The true minimum may lie beyond the ends of the range.
        if (index == 0 || index >= job_.numDisparities - 1) {
            return false;
        }
        const int best = r.best[x];
        if (r.second[x] * (100 - options_.uniqueness) < best * 100) {
            return false;
        }
        const int curvature = r.before[x] + r.after[x] - 2 * best;
        if (static_cast<float>(curvature) < static_cast<float>(options_.sharpness) * pixels_) {
            return false;
        }
        const int partner = static_cast<int>(x) - options_.minDisparity - index;
        return !options_.leftRightCheck ||
               (partner >= 0 && partner < job_.width &&
                std::abs(r.rightIndex[x] - index) <= options_.leftRightTolerance);
    }

    void write(std::size_t i, const kernel::RowResult& r, std::size_t x) const {
        const auto before = static_cast<float>(r.before[x]);
        const auto after = static_cast<float>(r.after[x]);
        const auto best = static_cast<float>(r.best[x]);
        const float curvature = std::max(1.0F, before + after - 2 * best);
        const float shift = options_.subpixel ? 0.5F * (before - after) / curvature : 0.0F;
        out_.disparity[i] =
            static_cast<float>(options_.minDisparity + static_cast<int>(r.bestIndex[x])) + shift;
        const auto floor = static_cast<float>(options_.sigmaFloor);
        const float spread =
            static_cast<float>(options_.imageNoise) * std::sqrt(pixels_) / curvature;
        out_.sigma[i] = std::sqrt(floor * floor + spread * spread);
    }

    const StereoOptions& options_;
    const kernel::MatchJob& job_;
    DisparityImage& out_;
    float pixels_ = 0;  ///< in a cost
};

}  // namespace

struct PaperMatcher::Buffers {
    GreyPair grey;
    std::vector<std::uint8_t> left, right, reversed;
    std::vector<AlignedBuffer<std::uint16_t>> scratch;  ///< one a strip
};

PaperMatcher::PaperMatcher(const StereoOptions& options)
    : options_(options), buffers_(std::make_unique<Buffers>()) {
    if (options.window % 2 == 0) {
        throw ConfigError("[Stereo] window = " + std::to_string(options.window) +
                          ": allowed: odd, 3 .. 21");
    }
}

PaperMatcher::~PaperMatcher() = default;

void PaperMatcher::compute(const cv::Mat& left, const cv::Mat& right, DisparityImage& out) {
    Buffers& b = *buffers_;
    toGreyPair(left, right, b.grey);
    const int width = b.grey.left.cols;
    const int height = b.grey.left.rows;
    const int range = options_.numDisparities;
    out.resize(width, height);
    out.minDisparity = static_cast<float>(options_.minDisparity);
    out.maxDisparity = static_cast<float>(options_.minDisparity + range - 1);
    out.firstColumn = std::clamp(options_.minDisparity + range - 1, 0, width);

    const auto [half, offset] = layoutOf(options_);
    const int padded = (range + kernel::kLanes - 1) / kernel::kLanes * kernel::kLanes;
    const auto w = static_cast<std::size_t>(width);
    const auto pixels = w * static_cast<std::size_t>(height);
    const std::size_t reversedStride = w + static_cast<std::size_t>(padded);
    b.left.resize(pixels);
    b.right.resize(pixels);
    b.reversed.resize(reversedStride * static_cast<std::size_t>(height));
    const kernel::MatchJob job = {.width = width,
                                  .height = height,
                                  .numDisparities = range,
                                  .paddedDisparities = padded,
                                  .left = b.left.data(),
                                  .rightReversed = b.reversed.data(),
                                  .reversedStride = reversedStride,
                                  .truncation = options_.truncation,
                                  .halfWindow = half,
                                  .supportOffset = offset,
                                  .penaltySmall = 0,
                                  .penaltyLarge = 0};

    // Strips only share out the work: each row comes out the same whatever strip it is in.
    const int strips = std::clamp(tbb::this_task_arena::max_concurrency(), 1, height);
    b.scratch.resize(static_cast<std::size_t>(strips));
    const auto firstRow = [&](int strip) { return strip * height / strips; };
    const std::size_t scratchSize = std::max(kernel::scratchSize(job), 4 * (w + 16));

    tbb::parallel_for(0, strips, [&](int strip) {
        auto* scratch = b.scratch[static_cast<std::size_t>(strip)].get(scratchSize);
        const int first = firstRow(strip), last = firstRow(strip + 1);
        const auto filter = [&](const cv::Mat& image, std::vector<std::uint8_t>& to) {
            kernel::prefilterRows(filterOf(options_.prefilter), options_.prefilterGain,
                                  options_.prefilterCap, image.data, image.step[0], width, height,
                                  first, last, scratch, to.data());
        };
        filter(b.grey.left, b.left);
        filter(b.grey.right, b.right);
        for (int row = first; row < last; ++row) {
            const auto r = static_cast<std::size_t>(row);
            kernel::reverseRight(b.right.data() + r * w, width, options_.minDisparity,
                                 reversedStride, b.reversed.data() + r * reversedStride);
        }
    });

    const RowFinisher finish(options_, job, out);
    tbb::parallel_for(0, strips, [&](int strip) {
        auto* scratch = b.scratch[static_cast<std::size_t>(strip)].get(scratchSize);
        const auto done = [](void* context, int row, const kernel::RowResult& result) {
            (*static_cast<const RowFinisher*>(context))(row, result);
        };
        kernel::matchRows(job, firstRow(strip), firstRow(strip + 1), scratch, done,
                          const_cast<RowFinisher*>(&finish));
    });
    removeIsolated(out, options_.isolatedSize, static_cast<float>(options_.isolatedDifference));
}

}  // namespace riftmap
