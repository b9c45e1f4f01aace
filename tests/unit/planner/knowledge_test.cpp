// SPDX-License-Identifier: BSD-3-Clause
// Where the camera can get to, by all that is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "planner_scene.h"
#include "riftmap/planner/view_planner.h"

namespace riftmap {
namespace {

/// A slit between two blocks, 1.2 to 2 metres ahead, and a wall four metres ahead.
class Slit : public testing::Test {
 protected:
    /// Seen from six places, so that the way to the blocks is known; the last one is in front of
    /// the slit.
    void see(double half) {
        for (const Eigen::Vector3d& eye :
             {Eigen::Vector3d(0, 0.5, 0), Eigen::Vector3d(0, -0.5, 0), Eigen::Vector3d(0, 0, 0.5),
              Eigen::Vector3d(0, 0, -0.5), Eigen::Vector3d(-1.5, 0, 0), Eigen::Vector3d(0, 0, 0)}) {
            const View view =
                test::viewOf(lookAt(eye, eye + Eigen::Vector3d::UnitX()),
                             [half](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
                                 return ahead(half, o, d);
                             });
            graph.merge(view);
            knowledge.update(view);
        }
        knowledge.updateReach();
    }
    /// Distance along a ray to the blocks' front, the sides of the slit, or the wall.
    static std::optional<double> ahead(double half, const Eigen::Vector3d& origin,
                                       const Eigen::Vector3d& ray) {
        const double front = *test::wall(1.2)(origin, ray);
        const auto height = [&](double t) { return std::abs((origin + t * ray).z()); };
        if (height(front) > half) {
            return front;
        }
        const double side = ((ray.z() > 0 ? half : -half) - origin.z()) / ray.z();
        const double back = *test::wall(2.0)(origin, ray);
        return height(back) > half ? side : *test::wall(4.0)(origin, ray);
    }
    static PlatformLimits limits() {
        PlatformLimits limits;
        limits.boxMin = Eigen::Vector3d(-2, -2, -2);
        limits.boxMax = Eigen::Vector3d(4, 2, 2);
        limits.clearance = 0.2;
        limits.farLimit = 6;
        return limits;
    }
    static PlannerOptions options() {
        PlannerOptions o;
        o.voxelSize = 0.15;
        return o;
    }

    PixelGraph graph{test::graphOptions(0.05)};
    Knowledge knowledge{graph, limits(), options()};
    const Eigen::Vector3d behind{2.8, 0, 0};
};

TEST_F(Slit, tooNarrowForVoxelsIsAPassageAllTheSame) {
    see(0.45);
    ASSERT_FALSE(knowledge.placeAt(behind)) << "the test needs a slit that voxels do not see";
    EXPECT_TRUE(knowledge.openPassages(false));
    const auto place = knowledge.placeAt(behind);
    ASSERT_TRUE(place);
    Eigen::Vector3d at = knowledge.camera().translation;
    for (const Pose& pose : knowledge.pathTo(lookAt(place->eye, {4, 0, 0}))) {
        for (double s = 0; s <= 1; s += 0.05) {  // by the map: the walls are its only surface
            const Eigen::Vector3d p = at + s * (pose.translation - at);
            EXPECT_FALSE(graph.nearest(p.cast<float>(), 0.2F)) << p.transpose();
        }
        at = pose.translation;
    }
    EXPECT_FALSE(knowledge.openPassages(true));  // they are open by now
    knowledge.updateReach();
    EXPECT_TRUE(knowledge.placeAt(behind));
}

TEST_F(Slit, tooNarrowForWaysBetweenVoxelsIsNone) {
    see(0.27);  // wider than the clearance of 0.22 m, but the ways between two centres dip
    const auto before = knowledge.space().reachable(1);
    EXPECT_FALSE(knowledge.openPassages(false));
    EXPECT_FALSE(knowledge.placeAt(behind));
    EXPECT_EQ(knowledge.space().reachable(1), before);
}

TEST_F(Slit, isLookedForNowAndThenAndAtTheEnd) {
    see(0.27);
    EXPECT_FALSE(knowledge.openPassages(false));
    see(0.45);
    EXPECT_FALSE(knowledge.openPassages(false));  // a look was just taken
    EXPECT_TRUE(knowledge.openPassages(true));
    EXPECT_TRUE(knowledge.placeAt(behind));
}

TEST_F(Slit, isNotLookedForWhileItCouldLeadNowhere) {
    see(0);                                          // no slit
    knowledge.space().declareFree({-0.5, 0, 0}, 1);  // what no view saw, from place to place
    knowledge.updateReach();
    ASSERT_EQ(knowledge.space().clearCount(), knowledge.reached());
    EXPECT_FALSE(knowledge.openPassages(false));
    see(0.45);
    ASSERT_GT(knowledge.space().clearCount(), knowledge.reached());
    EXPECT_TRUE(knowledge.openPassages(false));  // the first look
}

/// A camera that sinks, looking ahead, does not know what is below it, and being there does not
/// tell. (It freed its way into the floor once, step by step.)
TEST_F(Slit, noWayIsFreedByGoingThere) {
    see(0);
    ASSERT_FALSE(knowledge.confined());
    double lowest = 0;
    for (const Eigen::Vector3d& place : knowledge.space().reachable(1)) {
        lowest = std::min(lowest, place.z());
    }
    for (int i = 0; i < 20; ++i) {
        const auto place =
            knowledge.placeAt(knowledge.camera().translation - Eigen::Vector3d(0, 0, 0.1));
        if (!place || place->path == 0) {
            break;
        }
        const View view =
            test::viewOf(lookAt(place->eye, place->eye + Eigen::Vector3d::UnitX()), test::wall(4));
        graph.merge(view);
        knowledge.update(view);
        knowledge.updateReach();
    }
    EXPECT_LT(knowledge.camera().translation.z(), 0.0);  // some way is known
    EXPECT_GE(knowledge.camera().translation.z(), lowest - 2 * knowledge.space().voxelSize());
}

TEST_F(Slit, theLeastGainFollowsTheDepthUnlessItIsGiven) {
    see(0.5);
    EXPECT_NEAR(knowledge.minGain(), 4e-4 * knowledge.summary().area(), 1e-12);
    PlatformLimits exact = limits();
    exact.depthKind = DepthKind::kExact;
    PlatformLimits pixelwise = limits();
    pixelwise.depthKind = DepthKind::kPixelwise;
    PlannerOptions given = options();
    given.minGain = 0.01;
    PlannerOptions object = options();
    object.surfaceBox = {1, -1, -1, 2, 1, 1};
    for (const auto& [l, o, share] :
         {std::tuple(exact, options(), 1e-4), std::tuple(exact, given, 0.01),
          std::tuple(pixelwise, options(), 7e-4), std::tuple(exact, object, 4e-4),
          std::tuple(limits(), object, 3e-4), std::tuple(pixelwise, object, 4.8e-4)}) {
        Knowledge other(graph, l, o);
        other.update(test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(1.2)));
        EXPECT_NEAR(other.minGain(), share * other.summary().area(), 1e-12);
    }
}

TEST_F(Slit, theLeastGainIsOfNoMoreThanTenImagesUnlessItIsGiven) {
    PlatformLimits near = limits();
    near.farLimit = 0.2;
    const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(1.2));
    graph.merge(view);
    Knowledge byDepth(graph, near, options());
    byDepth.update(view);
    const StereoCamera& c = view.camera;
    const double images = 10 * 0.2 * 0.2 * c.width * c.height / (c.fx * c.fy);
    ASSERT_GT(byDepth.summary().area(), 1.1 * images);
    EXPECT_NEAR(byDepth.minGain(), 4e-4 * images, 1e-12);
    PlannerOptions o = options();
    o.minGain = 0.01;
    Knowledge given(graph, near, o);
    given.update(view);
    EXPECT_NEAR(given.minGain(), 0.01 * given.summary().area(), 1e-12);
}

TEST_F(Slit, theCameraMayBeWhereNoWayLeads) {
    see(0.21);
    EXPECT_TRUE(knowledge.mayBeAt({1.6, 0, 0}));  // inside of it
    EXPECT_FALSE(std::isfinite(knowledge.space().distanceTo({1.6, 0, 0})));
    EXPECT_FALSE(knowledge.mayBeAt({1.6, 0, 0.1}));  // too near to its side
    EXPECT_FALSE(knowledge.mayBeAt({5, 0, 0}));      // out of its box
}

TEST_F(Slit, looksKnowWhetherTheViewHadAMatchThere) {
    View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(2.0));
    for (int row = 0; row < view.camera.height; ++row) {  // the right half is plain
        for (int column = view.camera.width / 2; column < view.camera.width; ++column) {
            view.disparity.disparity[view.disparity.index(column, row)] = kNoDisparity;
        }
    }
    graph.merge(view);
    knowledge.update(view);
    const Eigen::Vector3d plain(1.5, -0.4, 0);
    const Eigen::Vector3d textured(1.5, 0.4, 0);
    const Eigen::Vector3d behindTheCamera(-1.5, 0, 0);
    const Eigen::Vector3d besideImage(1.5, 1.9, 0);
    for (int i = 0; i < 40; ++i) {
        knowledge.noteLooks(view, {plain, textured, behindTheCamera, besideImage});
    }
    EXPECT_LT(knowledge.unseen().lookWorth(plain), 0.3);
    EXPECT_EQ(knowledge.unseen().lookWorth(textured), 1.0);
    // What is not in the image was not looked at.
    EXPECT_EQ(knowledge.unseen().lookWorth(behindTheCamera), 1.0);
    EXPECT_EQ(knowledge.unseen().lookWorth(besideImage), 1.0);
    // All are tries: what is unknown still is not looked at any more.
    const auto begin = [&](const Eigen::Vector3d& p) {  // a step of the walk before its voxel
        const FreeSpace& space = knowledge.space();
        const double step = 0.9 * space.voxelSize();
        const Eigen::Vector3d from = space.snap(p) - step * p.normalized();
        return space.firstUnknown(from, p.normalized(), 1.1 * step).begin;
    };
    EXPECT_LT(begin(plain), 0);
    EXPECT_LT(begin(besideImage), 0);
    EXPECT_GT(begin({1.5, -0.8, 0}), 0);
    EXPECT_GT(begin({1.5, -1.9, 0}), 0);
}

}  // namespace
}  // namespace riftmap
