// SPDX-License-Identifier: BSD-3-Clause
// Squares drawn in vector code, against plain loops, on every instruction set.
#include "square_kernel.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <array>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "riftmap/core/pose.h"

namespace riftmap {
namespace {

/// The nearest pixel, counted from 1; 0 for all that lie before the first.
int nearestPixel(float x) {
    return static_cast<int>(std::clamp(x, -1.0F, 1e6F) + 1.5F);
}

void drawSlowly(const SquareCamera& c, const SquareBatch& batch, std::vector<float>& depth) {
    for (std::size_t i = 0; i < batch.count; ++i) {
        const Eigen::Vector3f p =
            c.rotation * Eigen::Vector3f(batch.x[i], batch.y[i], batch.z[i]) + c.translation;
        if (!(p.z() >= c.nearest && p.z() <= c.farthest)) {
            continue;
        }
        const float u = c.fx * p.x() / p.z() + c.cx;
        const float v = c.fy * p.y() / p.z() + c.cy;
        const float r = c.fx * c.half / p.z();
        for (int row = 1; row <= c.height; ++row) {
            for (int column = 1; column <= c.width; ++column) {
                if (column >= nearestPixel(u - r) && column <= nearestPixel(u + r) &&
                    row >= nearestPixel(v - r) && row <= nearestPixel(v + r)) {
                    float& d = depth[static_cast<std::size_t>((row - 1) * c.width + column - 1)];
                    d = std::min(d, p.z());
                }
            }
        }
    }
}

TEST(SquareKernel, DrawsAsPlainLoopsDoOnEveryInstructionSet) {
    std::size_t drawn = 0;
    std::size_t empty = 0;
    for (std::uint32_t seed = 1; seed <= 60; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const auto uniform = [&](float a, float b) {
            return a + (b - a) * static_cast<float>(random()) / 4294967296.0F;
        };
        const Pose camera_T_world =
            lookAt({0.1, -0.2, 0.3}, {uniform(-1, 1), uniform(-1, 1), uniform(-0.9F, 0.9F)})
                .inverse();
        const bool onGrid = seed % 4 == 0;  // depths at the limits, rims on the middle of pixels
        SquareCamera camera;
        camera.rotation = camera_T_world.rotation.cast<float>();
        camera.translation = camera_T_world.translation.cast<float>();
        camera.width = 1 + static_cast<int>(random() % 45);
        camera.height = 1 + static_cast<int>(random() % 35);
        camera.fx = uniform(10, 40);
        camera.fy = uniform(10, 40);
        camera.cx = uniform(0, 40);
        camera.cy = uniform(0, 30);
        camera.half = uniform(0.001F, 0.3F);
        camera.nearest = 0.05F;
        camera.farthest = uniform(1, 4);
        if (onGrid) {
            camera.rotation.setIdentity();
            camera.translation.setZero();
            camera.width = 120 + static_cast<int>(random() % 20);
            camera.fx = camera.fy = 16;
            camera.cx = 60;
            camera.cy = 10;
            camera.half = 0.0625F;
            camera.nearest = 0.5F;
            camera.farthest = 2;
        }
        SquareBatch batch;
        batch.count = seed == 1 ? 0 : 1 + random() % SquareBatch::kMost;
        for (std::size_t i = 0; i < SquareBatch::kMost; ++i) {  // what lies behind is not drawn
            batch.x[i] = uniform(-3, 3);
            batch.y[i] = uniform(-3, 3);
            batch.z[i] = uniform(-3, 3);
            if (onGrid) {
                constexpr std::array<float, 6> depths = {0.25F, 0.499F, 0.5F, 1, 2, 2.001F};
                batch.z[i] = depths[random() % depths.size()];
                batch.x[i] =
                    batch.z[i] * static_cast<float>(static_cast<int>(random() % 160) - 80) / 32;
                batch.y[i] =
                    batch.z[i] * static_cast<float>(static_cast<int>(random() % 60) - 30) / 32;
            }
            if (random() % 20 == 0) {
                batch.y[i] = std::numeric_limits<float>::quiet_NaN();
            } else if (random() % 20 == 0) {
                batch.x[i] = random() % 2 == 0 ? 1e9F : -1e9F;
            }
        }
        std::vector<float> blank(static_cast<std::size_t>(camera.width * camera.height),
                                 std::numeric_limits<float>::infinity());
        for (float& d : blank) {
            d = random() % 4 == 0 ? uniform(0.5F, 3) : d;
        }
        std::vector<float> expected = blank;
        drawSlowly(camera, batch, expected);
        for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
            hwy::SetSupportedTargetsForTest(target);
            std::vector<float> depth = blank;
            drawSquares(camera, batch, depth.data());
            EXPECT_EQ(depth, expected) << hwy::TargetName(target);
        }
        hwy::SetSupportedTargetsForTest(0);
        for (std::size_t i = 0; i < blank.size(); ++i) {
            ++(expected[i] < blank[i] ? drawn : empty);
        }
    }
    EXPECT_GT(drawn, 1000U);
    EXPECT_GT(empty, 1000U);
}

}  // namespace
}  // namespace riftmap
