// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "planner_scene.h"
#include "riftmap/planner/free_space.h"

namespace riftmap {
namespace {

constexpr double kFar = 6;

SensorModel sensorOf(const View& view, bool exactDepth) {
    PlatformLimits limits;
    limits.farLimit = kFar;
    limits.depthKind = exactDepth ? DepthKind::kExact : DepthKind::kMatched;
    return SensorModel::of(view, limits);
}

EmptyPixels emptyPixelsOf(const View& view, bool exactDepth, bool backgroundIsFree) {
    const Eigen::AlignedBox3d small(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
    return FreeSpace(small, 0.1).emptyPixels(view, sensorOf(view, exactDepth), backgroundIsFree);
}

/// Spheres before nothing, as a pair of cameras at the origin sees them: where one camera alone
/// sees a surface there is no match.
class Spheres {
 public:
    explicit Spheres(std::mt19937& random) {
        std::uniform_real_distribution<double> in(-1, 1);
        for (Sphere& s : spheres_) {
            s = {{0.8 * in(random), 0.5 * in(random), 2.0 + 0.8 * in(random)},
                 0.2 + 0.15 * in(random)};
        }
    }
    /// Depth along a ray of z = 1.
    std::optional<double> depth(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const {
        double least = std::numeric_limits<double>::infinity();
        for (const Sphere& s : spheres_) {
            const Eigen::Vector3d o = origin - s.centre;
            const double b = o.dot(ray) / ray.squaredNorm();
            const double c = (o.squaredNorm() - s.radius * s.radius) / ray.squaredNorm();
            if (b * b > c) {
                least = std::min(least, -b - std::sqrt(b * b - c));
            }
        }
        return std::isfinite(least) ? std::optional(least) : std::nullopt;
    }
    View view() const {
        const double baseline = test::smallCamera().baseline;
        return test::viewOf(Pose(), [&](const auto& eye, const auto& ray) {
            auto z = depth(eye, ray);
            const Eigen::Vector3d right = eye + Eigen::Vector3d(baseline, 0, 0);
            if (z && *depth(right, (*z * ray - right) / *z) < *z - 1e-6) {
                z.reset();
            }
            return z;
        });
    }

 private:
    struct Sphere {
        Eigen::Vector3d centre;
        double radius = 0;
    };
    std::array<Sphere, 6> spheres_;
};

TEST(EmptyPixels, areNoDeeperThanWhatOneCameraAloneSees) {
    int halfOccluded = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const Spheres spheres(random);
        const View view = spheres.view();
        const EmptyPixels empty = emptyPixelsOf(view, false, true);
        int open = 0, background = 0;
        for (int row = 0; row < view.camera.height; ++row) {
            for (int column = 0; column < view.camera.width; ++column) {
                const std::size_t i = view.disparity.index(column, row);
                EXPECT_EQ(empty.proven[i], 0);
                if (view.disparity.valid(column, row)) {
                    EXPECT_EQ(empty.depth[i], 0);
                    continue;
                }
                const auto z =
                    spheres.depth(Eigen::Vector3d::Zero(),
                                  view.camera.backProject(column, row, 1) / view.camera.depth(1));
                if (z) {  // the strip may be a pixel wider than it should be
                    ++halfOccluded;
                    const double least = view.camera.depth(view.camera.disparity(*z) - 1);
                    EXPECT_LE(static_cast<double>(empty.depth[i]), least) << column << " " << row;
                } else {
                    ++background;
                    open += static_cast<double>(empty.depth[i]) == kFar ? 1 : 0;
                }
            }
        }
        EXPECT_GT(open, 0.6 * background);
    }
    EXPECT_GT(halfOccluded, 1000);
}

TEST(EmptyPixels, ofExactDepthAreSeenByOneCamera) {
    std::mt19937 random(1);
    const View view = Spheres(random).view();
    const EmptyPixels exact = emptyPixelsOf(view, true, true);
    const EmptyPixels noisy = emptyPixelsOf(view, false, true);
    std::size_t deeper = 0;
    for (std::size_t i = 0; i < exact.depth.size(); ++i) {
        EXPECT_GE(exact.depth[i], noisy.depth[i]);
        deeper += exact.depth[i] > noisy.depth[i] ? 1U : 0U;
    }
    EXPECT_GT(deeper, 100U);
}

TEST(EmptyPixels, areAsDeepWithAnOffsetOfTheDisparities) {
    std::mt19937 random(2);
    View view = Spheres(random).view();
    const EmptyPixels plain = emptyPixelsOf(view, false, true);
    view.camera.doffs = 10;
    view.disparity.minDisparity -= 10;
    for (float& d : view.disparity.disparity) {
        d -= 10;
    }
    const EmptyPixels shifted = emptyPixelsOf(view, false, true);
    for (std::size_t i = 0; i < plain.depth.size(); ++i) {
        ASSERT_NEAR(shifted.depth[i], plain.depth[i], 1e-4);
    }
}

TEST(EmptyPixels, ofExactDepthAreSeenThroughANarrowHole) {
    View view = test::viewOf(Pose(), [](const auto&, const auto&) { return std::optional(2.0); });
    for (int column = 100; column < 107; ++column) {
        view.disparity.disparity[view.disparity.index(column, 95)] = kNoDisparity;
    }
    const std::size_t hole = view.disparity.index(103, 95);
    EXPECT_EQ(emptyPixelsOf(view, true, true).depth[hole], static_cast<float>(kFar));
    EXPECT_EQ(emptyPixelsOf(view, false, true).depth[hole], 0.0F);
}

TEST(EmptyPixels, areNoneWhereTheBackgroundMayHideSurface) {
    std::mt19937 random(1);
    const EmptyPixels empty = emptyPixelsOf(Spheres(random).view(), false, false);
    EXPECT_TRUE(std::all_of(empty.depth.begin(), empty.depth.end(),
                            [](float depth) { return depth == 0.0F; }));
}

TEST(EmptyPixels, ofExactDepthAreProvenWhereNothingCanBeTooNear) {
    std::array<std::size_t, 2> count{};
    for (unsigned seed = 1; seed <= 12; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> in(-1, 1);
        View view = Spheres(random).view();
        view.world_T_camera = lookAt({0.02, -0.01, 0.03}, {0.3 * in(random), 0.3 * in(random), 1});
        // What may hold surface begins somewhere in the space before the near limit.
        const Eigen::Vector3d low(0.3 * in(random), 0.3 * in(random), 0.4 + 0.3 * in(random));
        const Eigen::AlignedBox3d surfaces(low, low + Eigen::Vector3d::Ones());
        const Eigen::Vector3d half(2, 2, seed % 3 == 0 ? 0.3 : 2);  // or the grid ends there
        FreeSpace space(Eigen::AlignedBox3d(-half, half), 0.07);
        space.declareFreeOutside(surfaces);
        SensorModel sensor = sensorOf(view, true);
        sensor.nearLimit = 0.53;
        sensor.clearance = 0.1;
        const EmptyPixels empty = space.emptyPixels(view, sensor, false);
        const auto proven = [&](const Eigen::Vector3d& place) {
            const double off = surfaces.exteriorDistance(space.snap(place));
            return Eigen::AlignedBox3d(-half, half).contains(place) && off > 0.5 * 0.07;
        };
        for (int row = 0; row < view.camera.height; ++row) {
            for (int column = 0; column < view.camera.width; ++column) {
                const std::size_t i = view.disparity.index(column, row);
                const Eigen::Vector3d ray = view.camera.backProject(column, row, 1).normalized();
                const double end = 0.53 / ray.z();
                bool slow = !view.disparity.valid(column, row);
                for (double s = 0.1; slow && s < end + 0.25 * 0.07; s += 0.25 * 0.07) {
                    slow = proven(view.world_T_camera * Eigen::Vector3d(std::min(s, end) * ray));
                }
                ASSERT_EQ(empty.proven[i] != 0, slow) << column << " " << row;
                ++count[slow ? 1 : 0];
            }
        }
    }
    EXPECT_GT(count[0], 10000U);
    EXPECT_GT(count[1], 10000U);
}

}  // namespace
}  // namespace riftmap
