// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/paper_matcher.h"

#include <hwy/aligned_allocator.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <vector>

#include "match_kernel.h"
#include "riftmap/core/parallel.h"
#include "riftmap/stereo/disparity_filters.h"
#include "riftmap/stereo/grey.h"
#include "riftmap/stereo/image_noise.h"

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

/// Matches a grey pair with everything that works pixel by pixel; keeps its buffers.
class Level {
 public:
    /// `noise`: of the images [grey levels]; `firstColumn`: the first column of `out` that is
    /// matched.
    void match(const StereoOptions& options, const cv::Mat& left, const cv::Mat& right,
               double noise, int firstColumn, DisparityImage& out);

 private:
    static constexpr int kStripsPerThread = 3;

    std::vector<std::uint8_t> left_, right_, reversed_;
    std::vector<AlignedBuffer<std::uint16_t>> scratch_;  ///< one a thread
};

/// Standard deviation that the prefilter makes of noise of 1 grey level: the root of the sum of its
/// squared weights.
double noiseGain(const StereoOptions& options) {
    switch (options.prefilter) {
        case Prefilter::kDog:
            return 0.2799 * options.prefilterGain;
        case Prefilter::kGradient:
            return 3.4641 * options.prefilterGain;
        case Prefilter::kNone:
            break;
    }
    return 1;
}

/// sigma from the minimum's shape for image noise of `noise` grey levels; a cost sums up `pixels`.
kernel::MatchJob::Sigma sigmaModelOf(const StereoOptions& options, double noise, int pixels) {
    constexpr double kMeanDifference = 1.12838;  // mean |a - b| of two samples, noise 1
    constexpr double kSure = 1.75;  // costs vary: noise alone hardly ever makes more of its mean
    constexpr double kWholePixel = 0.288675;       // rounding
    const int times = options.semiGlobal ? 2 : 1;  // that the passes add up a pixel's cost
    const double filtered = noise * noiseGain(options) * times;
    const double floor =
        options.subpixel ? options.sigmaFloor : std::hypot(options.sigmaFloor, kWholePixel);
    return {.floor = static_cast<float>(floor),
            .noise = static_cast<float>(options.sigmaNoise * filtered * std::sqrt(pixels)),
            .mismatch = static_cast<float>(options.sigmaMismatch),
            .explained = static_cast<float>(kSure * kMeanDifference * filtered * pixels)};
}

kernel::MatchJob jobOf(const StereoOptions& options, double noise, int width, int height) {
    const auto [half, offset] = layoutOf(options);
    const int range = options.numDisparities;
    const int windows = offset > 0 ? 3 : 1;
    const int pixels = (2 * half + 1) * (2 * half + 1) * windows;  // that a cost sums up
    const auto ofPixels = [&](double greyLevels) {
        return static_cast<int>(std::lround(greyLevels * pixels));
    };
    return {.width = width,
            .height = height,
            .minDisparity = options.minDisparity,
            .numDisparities = range,
            .paddedDisparities = (range + kernel::kLanes - 1) / kernel::kLanes * kernel::kLanes,
            .firstColumn = 0,
            .left = nullptr,
            .rightReversed = nullptr,
            .reversedStride = 0,
            .truncation = options.truncation,
            .halfWindow = half,
            .supportOffset = offset,
            .penaltySmall = options.semiGlobal ? ofPixels(options.penaltySmall) : 0,
            .penaltyLarge = options.semiGlobal ? std::max(1, ofPixels(options.penaltyLarge)) : 0,
            .anchorReach = options.anchorReach,
            .anchorMargin = ofPixels(options.anchorMargin),
            .subpixel = options.subpixel,
            .leftRightCheck = options.leftRightCheck,
            .leftRightTolerance = options.leftRightTolerance,
            .uniquenessRatio = options.uniqueness * 65536 / 100,
            .uniquenessMargin = options.uniqueness > 0 ? ofPixels(options.uniquenessMargin) : -1,
            .minCurvature = ofPixels(options.sharpness),
            .sigmaModel = sigmaModelOf(options, noise, pixels),
            .disparity = nullptr,
            .sigma = nullptr};
}

void Level::match(const StereoOptions& options, const cv::Mat& left, const cv::Mat& right,
                  double noise, int firstColumn, DisparityImage& out) {
    const int width = left.cols;
    const int height = left.rows;
    kernel::MatchJob job = jobOf(options, noise, width, height);
    const auto w = static_cast<std::size_t>(width);
    const auto h = static_cast<std::size_t>(height);
    const std::size_t stride = w + static_cast<std::size_t>(job.paddedDisparities);
    left_.resize(w * h);
    right_.resize(w * h);
    reversed_.resize(stride * h);
    out.width = width;
    out.height = height;
    out.disparity.resize(w * h);  // matchRows() writes every pixel
    out.sigma.resize(w * h);
    job.firstColumn = firstColumn;
    job.left = left_.data();
    job.rightReversed = reversed_.data();
    job.reversedStride = stride;
    job.disparity = out.disparity.data();
    job.sigma = out.sigma.data();

    // Strips only share out the work: each row comes out the same whatever strip it is in. A strip
    // costs as much as two rows to begin. Threads take them from the largest to the smallest, so
    // that few are enough to keep all of them busy to the end, and each keeps its own scratch.
    const int threads = tbb::this_task_arena::max_concurrency();
    const int strips = std::clamp(threads > 1 ? kStripsPerThread * threads : 1, 1, height);
    scratch_.resize(std::max(scratch_.size(), static_cast<std::size_t>(threads)));
    const std::size_t scratchSize = std::max(kernel::scratchSize(job), 2 * (w + 16));
    const auto startOf = [&](int strip) {
        const std::int64_t rest = strips - strip;
        return height - static_cast<int>(height * rest * rest / (std::int64_t{strips} * strips));
    };
    const auto inStrips = [&](auto&& work) {
        std::atomic<int> next{0};
        parallelForEach(threads, 1, [&](int thread) {
            auto* scratch = scratch_[static_cast<std::size_t>(thread)].get(scratchSize);
            for (int i = next++; i < strips; i = next++) {
                work(startOf(i), startOf(i + 1), scratch);
            }
        });
    };
    inStrips([&](int first, int last, std::uint16_t* scratch) {
        const auto filter = [&](const cv::Mat& image, std::uint8_t* to) {
            kernel::prefilterRows(filterOf(options.prefilter), options.prefilterGain,
                                  options.prefilterCap, image.data, image.step[0], width, height,
                                  first, last, scratch, to);
        };
        filter(left, left_.data());
        filter(right, right_.data());
        for (auto r = static_cast<std::size_t>(first); r < static_cast<std::size_t>(last); ++r) {
            kernel::reverseRight(right_.data() + r * w, width, options.minDisparity, stride,
                                 reversed_.data() + r * stride);
        }
    });
    inStrips([&](int first, int last, std::uint16_t* scratch) {
        kernel::matchRows(job, first, last, scratch);
    });
}

constexpr int kCoarse = 4;  ///< side of the blocks that are one pixel of the coarse level

/// Means of whole blocks of kCoarse x kCoarse pixels. `sums`: scratch.
void shrink(const cv::Mat& image, std::vector<std::uint16_t>& sums, cv::Mat& out) {
    static_assert(kCoarse == 4);
    out.create(image.rows / kCoarse, image.cols / kCoarse, CV_8UC1);
    sums.resize(static_cast<std::size_t>(image.cols));
    for (int r = 0; r < out.rows; ++r) {
        const auto* row0 = image.ptr<std::uint8_t>(kCoarse * r);
        const auto* row1 = image.ptr<std::uint8_t>(kCoarse * r + 1);
        const auto* row2 = image.ptr<std::uint8_t>(kCoarse * r + 2);
        const auto* row3 = image.ptr<std::uint8_t>(kCoarse * r + 3);
        for (std::size_t c = 0; c < sums.size(); ++c) {
            sums[c] = static_cast<std::uint16_t>(row0[c] + row1[c] + row2[c] + row3[c]);
        }
        auto* to = out.ptr<std::uint8_t>(r);
        for (int c = 0; c < out.cols; ++c) {
            const std::uint16_t* s = sums.data() + kCoarse * static_cast<std::ptrdiff_t>(c);
            to[c] = static_cast<std::uint8_t>((s[0] + s[1] + s[2] + s[3] + 8) / 16);
        }
    }
}

/// A matcher that only searches its range finds something there for every surface, also for one
/// that is nearer. This searches a longer range, coarsely, and discards matches where the better
/// explanation lies beyond.
class NearGuard {
 public:
    /// Looks for surfaces beyond the range.
    void search(const StereoOptions& options, const GreyPair& pair) {
        found_.resize(0, 0);
        StereoOptions coarse = options;
        const int end = options.minDisparity + options.numDisparities + options.guard;
        coarse.minDisparity = static_cast<int>(std::floor(options.minDisparity / double{kCoarse}));
        // Two more: a minimum needs a neighbour on either side.
        coarse.numDisparities =
            static_cast<int>(std::ceil(end / double{kCoarse})) + 2 - coarse.minDisparity;
        coarse.window = std::min(options.window, 7);
        coarse.semiGlobal = false;
        coarse.subpixel = true;
        if (options.guard <= 0 || pair.left.cols < 2 * kCoarse || pair.left.rows < 2 * kCoarse) {
            return;
        }
        shrink(pair.left, sums_, left_);
        shrink(pair.right, sums_, right_);
        level_.match(coarse, left_, right_, 0, 0, found_);
        // A wrong match here would cost true ones there: it must not stand alone.
        isolated_.apply(found_, kLeastSurface, 1.0F);
    }

    /// Discards what lies in or beside a coarse pixel whose surface is too near.
    void discard(DisparityImage& image) const {
        const float beyond = image.maxDisparity + 2;
        for (int r = 0; r < found_.height; ++r) {
            for (int c = 0; c < found_.width; ++c) {
                if (found_.valid(c, r) && found_.at(c, r) * kCoarse >= beyond) {
                    clear(image,
                          cv::Rect((c - 1) * kCoarse, (r - 1) * kCoarse, 3 * kCoarse, 3 * kCoarse));
                }
            }
        }
    }

 private:
    static void clear(DisparityImage& image, cv::Rect block) {
        block &= cv::Rect(0, 0, image.width, image.height);
        for (int r = block.y; r < block.y + block.height; ++r) {
            auto* first = image.disparity.data() + image.index(block.x, r);
            std::fill(first, first + block.width, kNoDisparity);
        }
    }

    static constexpr int kLeastSurface = 12;  ///< [coarse px]

    Level level_;
    IsolatedFilter isolated_;
    std::vector<std::uint16_t> sums_;
    cv::Mat left_, right_;
    DisparityImage found_;
};

}  // namespace

struct PaperMatcher::Buffers {
    GreyPair grey;
    Level level;
    NearGuard guard;
    IsolatedFilter isolated;
    NoiseMeter noise;
    RimFilter rim;
    std::vector<float> scratch;
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
    const int maxDisparity = options_.minDisparity + options_.numDisparities - 1;
    out.minDisparity = static_cast<float>(options_.minDisparity);
    out.maxDisparity = static_cast<float>(maxDisparity);
    out.firstColumn = std::clamp(maxDisparity, 0, b.grey.left.cols);
    const double noise =
        options_.imageNoise > 0 ? options_.imageNoise : b.noise.measure(b.grey.left);
    parallelForEach(2, 1, [&](int half) {
        if (half == 0) {
            b.level.match(options_, b.grey.left, b.grey.right, noise, out.firstColumn, out);
        } else {
            b.guard.search(options_, b.grey);
        }
    });
    b.guard.discard(out);
    b.isolated.apply(out, options_.isolatedSize, static_cast<float>(options_.isolatedDifference));
    b.rim.apply(b.grey.left, options_.rimTexture, out);
    discardSilhouettes(out, options_.silhouetteReach, options_.silhouetteRows,
                       static_cast<float>(options_.silhouetteStep), b.scratch);
    growSigmaWithSlope(out, static_cast<float>(options_.sigmaSlope));
}

}  // namespace riftmap
