// SPDX-License-Identifier: BSD-3-Clause
// PaperMatcher takes no memory after the first frame of a size. This program counts every
// allocation of the process: its malloc family stands in for the C library's, which operator new,
// OpenCV, Highway and oneTBB all end in.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "riftmap/stereo/paper_matcher.h"

namespace {

std::atomic<bool> counting{false};
std::atomic<std::size_t> allocations{0};
std::atomic<std::size_t> bytes{0};
std::atomic<std::size_t> largest{0};

void count(std::size_t size) {
    if (counting) {
        ++allocations;
        bytes += size;
        for (std::size_t l = largest; size > l && !largest.compare_exchange_weak(l, size);) {
        }
    }
}

}  // namespace

// The C library's own, under the names that it keeps for this.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t n, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
    count(size);
    return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
    count(n * size);
    return __libc_calloc(n, size);
}
void* realloc(void* old, std::size_t size) {
    count(size);
    return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
    count(size);
    return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    return memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
    *out = memalign(alignment, size);
    return *out != nullptr ? 0 : ENOMEM;
}
}

namespace riftmap {
namespace {

struct Counted {
    std::size_t allocations, bytes, largest;
};

template <class Work>
Counted counted(const Work& work) {
    allocations = bytes = largest = 0;
    counting = true;
    work();
    counting = false;
    return {allocations, bytes, largest};
}

struct Frame {
    cv::Mat left, right;
};

/// Texture of a grain of `grain` px, shifted by `shift`: fine grain gives few large groups, none at
/// all many small ones.
Frame frame(int type, std::uint64_t seed, int shift, double noise) {
    cv::Mat wide(120, 400, CV_8UC1);
    cv::RNG rng(seed);
    rng.fill(wide, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(wide, wide, {5, 5}, 1.0);
    cv::Mat left = wide.colRange(0, 300).clone(), right = wide.colRange(shift, 300 + shift).clone();
    for (cv::Mat* image : {&left, &right}) {
        cv::Mat add(image->size(), CV_16SC1);
        cv::randn(add, 0, noise);
        cv::add(*image, add, *image, cv::noArray(), CV_8U);
        image->convertTo(*image, CV_MAT_DEPTH(type), CV_MAT_DEPTH(type) == CV_16U ? 256 : 1);
        if (CV_MAT_CN(type) == 3) {
            cv::cvtColor(*image, *image, cv::COLOR_GRAY2BGR);
        }
    }
    return {left, right};
}

class Allocations : public ::testing::TestWithParam<int> {};

TEST_P(Allocations, NoneAfterTheFirstFrameOfASize) {
    const int type = GetParam();
    std::vector<Frame> frames;
    for (const double noise : {1.0, 60.0, 8.0, 200.0, 2.0, 25.0}) {
        frames.push_back(frame(type, frames.size(), 7 + static_cast<int>(frames.size()), noise));
    }
    for (const bool semiGlobal : {false, true}) {
        StereoOptions options;
        options.numDisparities = 32;
        options.semiGlobal = semiGlobal;
        options.rimTexture = 6;
        PaperMatcher matcher(options);
        DisparityImage out;
        for (const int threads : {1, 2}) {
            tbb::task_arena arena(threads);
            arena.execute([&] { matcher.compute(frames[0].left, frames[0].right, out); });
            for (std::size_t i = 0; i < frames.size(); ++i) {
                const Counted c = counted([&] {
                    arena.execute([&] { matcher.compute(frames[i].left, frames[i].right, out); });
                });
                EXPECT_EQ(c.allocations, 0U)
                    << "frame " << i << ", " << threads << " threads, semi-global " << semiGlobal
                    << ": " << c.bytes << " bytes, the largest " << c.largest;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Formats, Allocations,
                         ::testing::Values(CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3),
                         [](const auto& p) {
                             return std::string(CV_MAT_DEPTH(p.param) == CV_8U ? "Bits8"
                                                                               : "Bits16") +
                                    (CV_MAT_CN(p.param) == 1 ? "Grey" : "Colour");
                         });

/// The counter counts: what a matcher takes at its first frame.
TEST(AllocationCounter, SeesThoseOfTheFirstFrame) {
    const Frame f = frame(CV_8UC1, 1, 5, 1);
    PaperMatcher matcher{StereoOptions()};
    DisparityImage out;
    const Counted c = counted([&] { matcher.compute(f.left, f.right, out); });
    EXPECT_GT(c.bytes, f.left.total() * 2 * sizeof(float));
}

}  // namespace
}  // namespace riftmap
