// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/seen_through.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "planner_scene.h"
#include "riftmap/planner/view_planner.h"

namespace riftmap {
namespace {

constexpr double kResolution = 0.02;

/// A box about the origin that stands alone, and what views of it tell.
class Box : public testing::Test {
 protected:
    explicit Box(const Eigen::Vector3d& half = {0.1, 0.3, 0.3}) : half_(half) {}

    void see(const Eigen::Vector3d& eye) {
        const View view = test::viewOf(
            lookAt(eye, Eigen::Vector3d::Zero()),
            [this](const Eigen::Vector3d& o, const Eigen::Vector3d& d) { return hit(o, d); });
        PlatformLimits limits;
        limits.farLimit = 6;
        seen.add(view, SensorModel::of(view, limits), true);
        graph.merge(view);
    }
    std::optional<Gap> gapAt(const Eigen::Vector3d& rim, const Eigen::Vector3d& normal,
                             const Eigen::Vector3d& outward) const {
        return gapBeside(graph, seen, rim, normal, outward, kResolution);
    }

    static GraphOptions options() {
        GraphOptions o;
        o.targetResolution = kResolution;
        return o;
    }
    PixelGraph graph{options()};
    SeenThrough seen;

 private:
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
    Eigen::Vector3d half_;
};

class Plate : public Box {
 protected:
    Plate() : Box({1e-4, 0.3, 0.3}) {}
};

TEST_F(Box, knowsWhatLiesBeforeItsSurfaceAndBesideIt) {
    see({-2, 0.01, 0.02});
    EXPECT_TRUE(seen.at({-0.3, 0, 0}));
    EXPECT_TRUE(seen.at({0, 0.4, 0}));    // background
    EXPECT_FALSE(seen.at({0, 0, 0}));     // inside
    EXPECT_FALSE(seen.at({0.5, 0, 0}));   // behind
    EXPECT_FALSE(seen.at({-1.5, 2, 0}));  // out of the image
    EXPECT_FALSE(seen.at({-2.5, 0, 0}));  // behind the camera
}

TEST_F(Box, itsSideMayBeHiddenUntilItIsSeen) {
    const Eigen::Vector3d rim(-0.1, 0.3, 0);
    see({-2, 0.01, 0.02});
    const auto gap = gapAt(rim, {-1, 0, 0}, {0, 1, 0});
    ASSERT_TRUE(gap);
    EXPECT_NEAR(gap->width, 3 * kResolution, 1e-9);
    EXPECT_GT(gap->place.x(), -0.1);
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
    const auto gap = gapBeside(PixelGraph(options()), SeenThrough{}, {0, 0, 0}, {-1, 0, 0},
                               {0, 1, 0}, kResolution);
    ASSERT_TRUE(gap);
    EXPECT_LE(gap->place.x(), 1e-9);
}

TEST_F(Plate, hidesNothingWhereItsOtherSideIsKnown) {
    see({2, 0.01, 0.02});
    // As if the front had been seen up to the middle, and nothing through it.
    EXPECT_FALSE(gapBeside(graph, SeenThrough{}, {0, 0, 0}, {-1, 0, 0}, {0, 1, 0}, kResolution));
}

TEST_F(Plate, beforeHalfOccludedPixelsNothingIsKnown) {
    View view = test::viewOf(lookAt({-2, 0, 0}, {0, 0, 0}), test::wall(0.0));
    PlatformLimits limits;
    limits.farLimit = 6;
    for (int row = 90; row < 100; ++row) {
        for (int column = 100; column < 106; ++column) {
            view.disparity.disparity[view.disparity.index(column, row)] = kNoDisparity;
        }
    }
    seen.add(view, SensorModel::of(view, limits), true);
    const auto place = [&](int column) {  // halfway to the wall
        return Eigen::Vector3d(view.world_T_camera *
                               view.camera.backProject(column, 95, view.camera.disparity(1.0)));
    };
    EXPECT_TRUE(seen.at(place(98)));
    EXPECT_FALSE(seen.at(place(103)));
}

}  // namespace
}  // namespace riftmap
