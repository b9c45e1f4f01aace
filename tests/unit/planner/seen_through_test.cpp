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

TEST(PromiseKept, countsWhatCameOfTheLastViews) {
    PromiseKept kept(1.0);
    EXPECT_EQ(kept.share(), 1.0);
    kept.note(0.001, 0.0, 0.01);  // too small a promise
    EXPECT_EQ(kept.share(), 1.0);
    kept.note(1.0, 1.0, 0.01);
    EXPECT_NEAR(kept.share(), 1.0, 1e-9);
    double before = kept.share();
    for (int i = 0; i < 6; ++i) {
        kept.note(0.05, 0.0, 0.01);
        EXPECT_LT(kept.share(), before);
        before = kept.share();
    }
    EXPECT_LT(before, 0.25);
    kept.note(1.0, 1.0, 0.01);
    EXPECT_GT(kept.share(), 0.8);
}

TEST(PromiseKept, isAShareWhateverIsAskedFor) {
    PromiseKept kept(1.0);
    kept.note(0, 1, 0);
    kept.note(0, 0, 0);
    EXPECT_EQ(kept.share(), 1.0);
    ObjectMemory memory;
    memory.update(SurfaceSummary(0.08, 0.02), 0, 0.05);  // before the first surface
    for (const PromiseKept* p : {&memory.frontier, &memory.tears, &memory.doubt}) {
        EXPECT_EQ(p->share(), 1.0);
    }
}

/// Promises held against a view of a wall.
class Promises : public testing::Test {
 protected:
    Promises() {
        const View view = test::viewOf(lookAt({-2, 0, 0}, Eigen::Vector3d::Zero()), test::wall(0));
        graph.merge(view);
        summary.update(graph, view);
        came = summary.newArea();
        memory.looked = {place};
    }
    void update() { memory.update(summary, 1e-4, 0.05); }

    PixelGraph graph{GraphOptions()};
    SurfaceSummary summary{4 * kResolution, kResolution};
    const Eigen::Vector3d place{0.1, 0.1, 0.1};
    ObjectMemory memory;
    double came = 0;
};

TEST_F(Promises, newAreaCountsForDoubtAsFarAsNothingElsePromisedIt) {
    ASSERT_GT(came, 1.0);
    memory.tearGain = came;
    memory.doubtGain = 0.5 * came;
    update();
    EXPECT_NEAR(memory.tears.share(), 1.0, 1e-6);
    EXPECT_LT(memory.doubt.share(), 0.1);
    memory = {};
    memory.tearGain = memory.doubtGain = 0.5 * came;
    update();
    EXPECT_GT(memory.tears.share(), 1.9);
    EXPECT_NEAR(memory.doubt.share(), 1.0, 1e-6);
}

TEST_F(Promises, onlyAFrontierThatPromisedMostWasLookedAtInVain) {
    memory.frontierGain = came;
    memory.tearGain = 4 * came;
    update();
    EXPECT_EQ(memory.lookedInVain.left(place, 0.05), 1.0);
    EXPECT_NEAR(memory.frontier.share(), 0.2, 0.01);
    memory.frontierGain = 4 * came;
    memory.tearGain = 0;
    update();
    EXPECT_NEAR(memory.lookedInVain.left(place, 0.05), 0.3, 1e-9);
}

TEST(LookedInVain, takesWorthFromWhatLiesAroundInVainPlacesOnly) {
    LookedInVain looked;
    const Eigen::Vector3d place(0.03, -0.02, 0.5);
    const double edge = 0.025;  // [m] of the frontier's voxels: cubes of 0.2 m
    const auto left = [&](double dx) {
        return looked.left(place + Eigen::Vector3d(dx, 0, 0), edge);
    };
    looked.note({place}, 0.6, edge);
    EXPECT_EQ(left(0), 1.0);  // it brought enough
    looked.note({place, place + Eigen::Vector3d(0.01, 0, 0)}, 0.4, edge);
    EXPECT_DOUBLE_EQ(left(0), 0.4);  // once for a view, however many places
    EXPECT_DOUBLE_EQ(left(0.1), 0.4);
    EXPECT_EQ(left(0.3), 1.0);
    looked.note({place}, 0.0, edge);
    EXPECT_DOUBLE_EQ(left(0), 0.4 * 0.3);
}

}  // namespace
}  // namespace riftmap
