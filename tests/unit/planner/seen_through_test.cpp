// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/seen_through.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "planner_scene.h"
#include "riftmap/planner/view_planner.h"

namespace riftmap {
namespace {

constexpr double kResolution = 0.02;

SensorModel sensorOf(const View& view) {
    PlatformLimits limits;
    limits.farLimit = 6;
    return SensorModel::of(view, limits);
}

/// With the background free.
EmptyPixels emptyPixelsOf(const View& view) {
    const Eigen::AlignedBox3d small(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
    return FreeSpace(small, 0.1).emptyPixels(view, sensorOf(view), true);
}

SeenThrough::Views all(const SeenThrough& seen) {
    const Eigen::Vector3d far = Eigen::Vector3d::Constant(100);
    return seen.into(Eigen::AlignedBox3d(-far, far));
}

/// A box about the origin that stands alone, and what views of it tell.
class Box : public testing::Test {
 protected:
    explicit Box(const Eigen::Vector3d& half = {0.1, 0.3, 0.3}) : half_(half) {}

    void see(const Eigen::Vector3d& eye) {
        const View view = test::viewOf(
            lookAt(eye, Eigen::Vector3d::Zero()),
            [this](const Eigen::Vector3d& o, const Eigen::Vector3d& d) { return hit(o, d); });
        seen.add(view, emptyPixelsOf(view));
        graph.merge(view);
    }
    std::optional<Gap> gapAt(const Eigen::Vector3d& rim, const Eigen::Vector3d& normal,
                             const Eigen::Vector3d& outward) const {
        return gapBeside(graph, all(seen), rim, normal, outward, kResolution);
    }

    static GraphOptions options() {
        GraphOptions o;
        o.targetResolution = kResolution;
        return o;
    }
    PixelGraph graph{options()};
    SeenThrough seen;

    std::optional<double> hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const {
        double near = 0, far = 100;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = (-half_[axis] - origin[axis]) / ray[axis];
            const double b = (half_[axis] - origin[axis]) / ray[axis];
            near = std::max(near, std::min(a, b));
            far = std::min(far, std::max(a, b));
        }
        return near < far && near > 0 ? std::optional(near) : std::nullopt;
    }

 private:
    Eigen::Vector3d half_;
};

class Plate : public Box {
 protected:
    Plate() : Box({1e-4, 0.3, 0.3}) {}
};

TEST_F(Box, knowsWhatLiesBeforeItsSurfaceAndBesideIt) {
    see({-2, 0.01, 0.02});
    EXPECT_TRUE(all(seen).seeThrough({-0.3, 0, 0}));
    EXPECT_TRUE(all(seen).seeThrough({0, 0.4, 0}));    // background
    EXPECT_FALSE(all(seen).seeThrough({0, 0, 0}));     // inside
    EXPECT_FALSE(all(seen).seeThrough({0.5, 0, 0}));   // behind
    EXPECT_FALSE(all(seen).seeThrough({-1.5, 2, 0}));  // out of the image
    EXPECT_FALSE(all(seen).seeThrough({-2.5, 0, 0}));  // behind the camera
}

TEST_F(Box, itsSideMayBeHiddenUntilItIsSeen) {
    const Eigen::Vector3d rim(-0.1, 0.3, 0);
    see({-2, 0.01, 0.02});
    const auto gap = gapAt(rim, {-1, 0, 0}, {0, 1, 0});
    ASSERT_TRUE(gap);
    EXPECT_NEAR(gap->width, 3 * kResolution, 1e-9);
    EXPECT_GT(gap->place.x(), -0.1);
    EXPECT_GT(gap->normal.y(), 0.9);  // as the side faces
    see({0.01, 2, 0.02});
    EXPECT_FALSE(gapAt(rim, {-1, 0, 0}, {0, 1, 0}));  // the side's surface comes first
}

TEST_F(Plate, thatWasSeenFromBothSidesEndsAtItsRim) {
    see({-2, 0.01, 0.02});
    EXPECT_TRUE(gapAt({0, 0.3, 0}, {-1, 0, 0}, {0, 1, 0}));
    see({2, 0.01, 0.02});
    EXPECT_FALSE(gapAt({0, 0.3, 0}, {-1, 0, 0}, {0, 1, 0}));
}

TEST_F(Plate, goesOnWhereNothingWasSeenAtAll) {
    see({-2, 0.01, 0.02});
    // As if the image had ended on the plate: beside it there is neither surface nor free space.
    const auto gap = gapBeside(PixelGraph(options()), SeenThrough::Views{}, {0, 0, 0}, {-1, 0, 0},
                               {0, 1, 0}, kResolution);
    ASSERT_TRUE(gap);
    EXPECT_LE(gap->place.x(), 1e-9);
}

TEST_F(Plate, hidesNothingWhereItsOtherSideIsKnown) {
    see({2, 0.01, 0.02});
    // As if the front had been seen up to the middle, and nothing through it.
    EXPECT_FALSE(
        gapBeside(graph, SeenThrough::Views{}, {0, 0, 0}, {-1, 0, 0}, {0, 1, 0}, kResolution));
}

TEST_F(Box, viewsIntoABoxAreAllThatSeeThroughAnythingInIt) {
    constexpr std::uint32_t kSeed = 7;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    std::mt19937 random(kSeed);
    const auto uniform = [&](double a, double b) {
        return a + (b - a) * static_cast<double>(random()) / 4294967296.0;
    };
    for (int i = 0; i < 12; ++i) {
        see(2 * Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized());
    }
    std::size_t leftOut = 0;
    std::size_t seenThrough = 0;
    for (int i = 0; i < 2000; ++i) {
        const Eigen::Vector3d corner(uniform(-3, 3), uniform(-3, 3), uniform(-3, 3));
        const double edge = uniform(0.05, 0.6);
        const auto views =
            seen.into(Eigen::AlignedBox3d(corner, corner + Eigen::Vector3d::Constant(edge)));
        leftOut += 12 - views.size();
        for (int k = 0; k < 20; ++k) {
            const Eigen::Vector3d place =
                corner + edge * Eigen::Vector3d(uniform(0, 1), uniform(0, 1), uniform(0, 1));
            ASSERT_EQ(views.seeThrough(place), all(seen).seeThrough(place)) << place.transpose();
            seenThrough += all(seen).seeThrough(place) ? 1 : 0;
        }
    }
    EXPECT_GT(leftOut, 2000U);
    EXPECT_GT(seenThrough, 4000U);
}

/// A panel of 2.5 cm that stands on a wall; what is seen of them depends on the eye.
class Panel : public Box {
 protected:
    Panel() : Box({0.0125, 0.3, 0.3}) {}
    void lookAtTheWall(const Eigen::Vector3d& eye) {
        const View view = test::viewOf(
            lookAt(eye, Eigen::Vector3d(eye.x(), -0.3, eye.z())),
            [this](const Eigen::Vector3d& o, const Eigen::Vector3d& d) -> std::optional<double> {
                const auto panel = hit(o, d);
                const double atWall = (-0.3 - o.y()) / d.y();
                if (d.y() > -1e-9 || (panel && *panel < atWall)) {
                    return panel;
                }
                return atWall;
            });
        seen.add(view, emptyPixelsOf(view));
        graph.merge(view);
    }
};

TEST_F(Panel, isHiddenOnOneSideThoughTheOtherIsKnown) {
    const Eigen::Vector3d besideThePanel(-0.015, -0.3, 0);
    lookAtTheWall({0.8, 1.2, 0.01});    // its right side
    lookAtTheWall({-0.013, 1.2, 0.0});  // straight along its left side
    const auto gap = gapAt(besideThePanel, {0, 1, 0}, {1, 0, 0});
    ASSERT_TRUE(gap);
    lookAtTheWall({-0.8, 1.2, 0.01});
    EXPECT_FALSE(gapAt(besideThePanel, {0, 1, 0}, {1, 0, 0}));
}

TEST_F(Box, emptyPixelsAreSeenThrough) {
    const View view = test::viewOf(lookAt({-2, 0, 0}, {0, 0, 0}), [](const auto&, const auto&) {
        return std::optional<double>();
    });
    EmptyPixels empty{std::vector<float>(view.disparity.disparity.size(), 0.0F), {}};
    seen.add(view, empty);
    EXPECT_FALSE(all(seen).seeThrough({0, 0, 0}));
    std::fill(empty.depth.begin(), empty.depth.end(), 6.0F);
    seen.add(view, empty);
    EXPECT_TRUE(all(seen).seeThrough({0, 0, 0}));
    EXPECT_FALSE(all(seen).seeThrough({4.5, 0, 0}));  // beyond the range
}

TEST_F(Plate, beforeHalfOccludedPixelsNothingIsKnown) {
    View view = test::viewOf(lookAt({-2, 0, 0}, {0, 0, 0}), test::wall(0.0));
    for (int row = 90; row < 100; ++row) {
        for (int column = 100; column < 106; ++column) {
            view.disparity.disparity[view.disparity.index(column, row)] = kNoDisparity;
        }
    }
    seen.add(view, emptyPixelsOf(view));
    const auto place = [&](int column) {  // halfway to the wall
        return Eigen::Vector3d(view.world_T_camera *
                               view.camera.backProject(column, 95, view.camera.disparity(1.0)));
    };
    EXPECT_TRUE(all(seen).seeThrough(place(98)));
    EXPECT_FALSE(all(seen).seeThrough(place(103)));
}

}  // namespace
}  // namespace riftmap
