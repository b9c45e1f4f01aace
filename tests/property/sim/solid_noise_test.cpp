// SPDX-License-Identifier: BSD-3-Clause
// The vector code of the noise against the same noise written plainly.
#include "solid_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace riftmap {
namespace {

float latticeValue(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    std::uint32_t h = (x * 0x9E3779B1U) ^ (y * 0x85EBCA77U) ^ (z * 0xC2B2AE3DU);
    h = (h ^ (h >> 15U)) * 0x2C1B3C6DU;
    h = (h ^ (h >> 12U)) * 0x297A2D39U;
    return static_cast<float>(h >> 16U) * (1.0F / 32767.5F) - 1.0F;
}

float valueNoise(const Eigen::Vector3f& p) {
    const Eigen::Vector3f cell(std::floor(p.x()), std::floor(p.y()), std::floor(p.z()));
    const Eigen::Vector3f t = p - cell;
    float corner[8];
    for (std::uint32_t i = 0; i < 8; ++i) {
        const auto at = [&](int k, std::uint32_t bit) {
            return static_cast<std::uint32_t>(static_cast<std::int32_t>(cell[k])) +
                   ((i & bit) != 0 ? 1U : 0U);
        };
        corner[i] = latticeValue(at(0, 1), at(1, 2), at(2, 4));
    }
    const auto smooth = [](float x) { return x * x * (3.0F - (x + x)); };
    const auto between = [](float a, float b, float w) { return a + w * (b - a); };
    const float wx = smooth(t.x());
    const float wy = smooth(t.y());
    const float low =
        between(between(corner[0], corner[1], wx), between(corner[2], corner[3], wx), wy);
    const float high =
        between(between(corner[4], corner[5], wx), between(corner[6], corner[7], wx), wy);
    return between(low, high, smooth(t.z()));
}

float reference(const Eigen::Vector3f& point, float size, float footprint) {
    float sum = 0;
    for (std::size_t octave = 0; octave < kNoiseOctaves; ++octave) {
        const float resolved = (size / footprint - 1.0F) * 0.5F;
        if (resolved > 0) {
            const Eigen::Matrix3f& r = noiseRotation(octave);
            const auto row = [&](int i) {
                return (r(i, 0) * point.x() + r(i, 1) * point.y() + r(i, 2) * point.z()) *
                       (1.0F / size);
            };
            sum += std::min(resolved, 1.0F) * noiseContrast(octave) *
                   valueNoise({row(0), row(1), row(2)});
        }
        size *= 0.5F;
    }
    return sum;
}

TEST(SolidNoise, VectorCodeGivesTheBitsOfPlainCode) {
    std::mt19937_64 random(77);
    std::uniform_real_distribution<float> place(-30, 30);
    std::uniform_real_distribution<float> size(0.05F, 3);
    std::uniform_real_distribution<float> footprint(5e-4F, 0.2F);
    for (const std::size_t count : {0U, 1U, 15U, 16U, 17U, 1000U}) {
        NoiseQueries queries;
        queries.resize(count);
        for (std::size_t i = 0; i < count; ++i) {
            queries.set(i, {place(random), place(random), place(random)}, size(random),
                        footprint(random));
        }
        std::vector<float> noise;
        solidNoise(queries, noise);
        ASSERT_EQ(noise.size(), count);
        for (std::size_t i = 0; i < count; ++i) {
            const Eigen::Vector3f p(queries.x[i], queries.y[i], queries.z[i]);
            EXPECT_EQ(noise[i], reference(p, queries.size[i], queries.footprint[i])) << i;
        }
    }
}

TEST(SolidNoise, HasContrastAtEveryScaleAndNoneBelowThePixel) {
    std::mt19937_64 random(78);
    std::uniform_real_distribution<float> place(-30, 30);
    const auto deviation = [&](float size, float footprint) {
        NoiseQueries queries;
        queries.resize(4000);
        for (std::size_t i = 0; i < queries.count(); ++i) {
            queries.set(i, {place(random), place(random), place(random)}, size, footprint);
        }
        std::vector<float> noise;
        solidNoise(queries, noise);
        double sum = 0;
        double squares = 0;
        for (const float n : noise) {
            sum += n;
            squares += n * n;
        }
        const double mean = sum / static_cast<double>(noise.size());
        EXPECT_NEAR(mean, 0, 0.02);
        return std::sqrt(squares / static_cast<double>(noise.size()) - mean * mean);
    };
    EXPECT_GT(deviation(0.5F, 0.001F), 0.1);
    EXPECT_GT(deviation(0.5F, 0.02F), 0.05);
    EXPECT_EQ(deviation(0.5F, 0.6F), 0);
}

}  // namespace
}  // namespace riftmap
