// SPDX-License-Identifier: BSD-3-Clause
#include "distance_kernel.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <bit>
#include <limits>
#include <string>

#include "random_scenes.h"

namespace riftmap {
namespace {

TEST(GraphKernels, VerticesWithinAreThoseWhoseDistanceIsOnEveryInstructionSet) {
    std::size_t within = 0;
    std::size_t without = 0;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        Page page;
        page.alive = 0;
        for (std::uint32_t slot = 0; slot < Page::kSize; ++slot) {
            const Eigen::Vector3f p = random.point(0.1).cast<float>();
            page.x[slot] = p.x();
            page.y[slot] = p.y();
            page.z[slot] = p.z();
            if (random.below(3) > 0) {
                page.alive |= std::uint64_t{1} << slot;
            } else if (random.below(2) == 0) {
                page.y[slot] = std::numeric_limits<float>::quiet_NaN();
            }
        }
        const Eigen::Vector3f point = random.point(0.1).cast<float>();
        // The limit itself counts.
        const float limit =
            squaredDistance(page, static_cast<std::uint32_t>(std::countr_zero(page.alive)), point);
        std::uint64_t expected = 0;
        for (std::uint32_t slot = 0; slot < Page::kSize; ++slot) {
            const bool in = page.living(slot) && squaredDistance(page, slot, point) <= limit;
            expected |= std::uint64_t{in ? 1U : 0U} << slot;
        }
        for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
            hwy::SetSupportedTargetsForTest(target);
            EXPECT_EQ(verticesWithin(page, point, limit), expected) << hwy::TargetName(target);
            Page empty = page;
            empty.alive = 0;
            EXPECT_EQ(verticesWithin(empty, point, limit), 0U);
        }
        hwy::SetSupportedTargetsForTest(0);
        within += static_cast<std::size_t>(std::popcount(expected));
        without += static_cast<std::size_t>(std::popcount(page.alive & ~expected));
    }
    EXPECT_GT(within, 1000U);
    EXPECT_GT(without, 1000U);
}

}  // namespace
}  // namespace riftmap
