// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/parallel.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numeric>
#include <stdexcept>
#include <vector>

namespace riftmap {
namespace {

TEST(ParallelFor, VisitsEveryIndexOnceInRangesOfTheGrain) {
    for (const std::size_t n : {0U, 1U, 7U, 8U, 9U, 1000U}) {
        for (const std::size_t grain : {1U, 8U, 5000U}) {
            std::vector<int> visits(n, 0);
            parallelFor(n, grain, [&](std::size_t begin, std::size_t end) {
                EXPECT_EQ(begin % grain, 0U);
                EXPECT_LE(end, n);
                EXPECT_TRUE(end - begin == grain || end == n);
                for (std::size_t i = begin; i < end; ++i) {
                    ++visits[i];
                }
            });
            EXPECT_EQ(visits, std::vector<int>(n, 1)) << n << " by " << grain;
        }
    }
}

TEST(ParallelFor, PassesExceptionsOn) {
    EXPECT_THROW(parallelFor(100, 1,
                             [](std::size_t begin, std::size_t) {
                                 if (begin == 57) {
                                     throw std::runtime_error("57");
                                 }
                             }),
                 std::runtime_error);
    EXPECT_THROW(parallelFor(1, 0, [](std::size_t, std::size_t) {}), std::invalid_argument);
}

// Sums of floats depend on their order: only a fixed one gives the same bits again.
TEST(ParallelReduce, SameBitsForAnyNumberOfThreads) {
    std::vector<float> values(100000);
    for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] = std::sin(static_cast<float>(i)) * std::exp2f(static_cast<float>(i % 31));
    }
    const auto sum = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return parallelReduce(
            values.size(), 64, 0.5F,
            [&](std::size_t begin, std::size_t end) {
                float s = 0;
                for (std::size_t i = begin; i < end; ++i) {
                    s += values[i];
                }
                return s;
            },
            [](float a, float b) { return a + b; });
    };
    float expected = 0.5F;
    for (std::size_t begin = 0; begin < values.size(); begin += 64) {
        float s = 0;
        for (std::size_t i = begin; i < std::min(values.size(), begin + 64); ++i) {
            s += values[i];
        }
        expected += s;
    }
    for (int repeat = 0; repeat < 20; ++repeat) {
        EXPECT_EQ(sum(1), expected);
        EXPECT_EQ(sum(8), expected);
    }
}

}  // namespace
}  // namespace riftmap
