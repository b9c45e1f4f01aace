// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/free_space.h"

#include <gtest/gtest.h>

#include "planner_scene.h"

namespace riftmap {
namespace {

using State = FreeSpace::State;
const Eigen::AlignedBox3d kBox(Eigen::Vector3d(-1, -2, -2), Eigen::Vector3d(4, 2, 2));

SensorModel sensorOf(const View& view) {
    PlatformLimits limits;
    limits.farLimit = 6;
    return SensorModel::of(view, limits);
}

TEST(FreeSpace, isFreeOnlyWhereAViewSawThrough) {
    FreeSpace space(kBox, 0.1);
    const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(3.0));
    space.carve(view, sensorOf(view), false);
    EXPECT_EQ(space.at({1.5, 0, 0}), State::kFree);
    EXPECT_EQ(space.at({2.7, 0.5, 0.5}), State::kFree);
    EXPECT_EQ(space.at({3.5, 0, 0}), State::kUnknown);    // behind the wall
    EXPECT_EQ(space.at({1.5, 1.8, 0}), State::kUnknown);  // outside of the field of view
    EXPECT_EQ(space.at({-0.5, 0, 0}), State::kUnknown);   // behind the camera
    EXPECT_EQ(space.at({9, 0, 0}), State::kUnknown);      // outside of the box
}

TEST(FreeSpace, theStripWithoutAPartnerIsNotSeen) {
    FreeSpace all(kBox, 0.1);
    FreeSpace cut(kBox, 0.1);
    const Pose pose = lookAt({0, 0, 0}, {1, 0, 0});
    const View whole = test::viewOf(pose, test::wall(3.0));
    const View strip = test::viewOf(pose, test::wall(3.0), 60);
    all.carve(whole, sensorOf(whole), false);
    cut.carve(strip, sensorOf(strip), false);
    const Eigen::Vector3d left(2.0, 0.9, 0.0);
    EXPECT_EQ(all.at(left), State::kFree);
    EXPECT_EQ(cut.at(left), State::kUnknown);
}

TEST(FreeSpace, pixelsWithoutAMatchAreKnownOnlyWhereTheBackgroundIsFree) {
    const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), [](const auto&, const auto&) {
        return std::optional<double>();
    });
    FreeSpace strict(kBox, 0.1);
    strict.carve(view, sensorOf(view), false);
    EXPECT_EQ(strict.at({1.5, 0, 0}), State::kUnknown);
    FreeSpace open(kBox, 0.1);
    open.carve(view, sensorOf(view), true);
    EXPECT_EQ(open.at({1.5, 0, 0}), State::kFree);
    // Known, but not proven free to fly through.
    open.updateClear(0.0, kBox);
    open.updateReach({0, 0, 0});
    EXPECT_TRUE(std::isinf(open.distanceTo({1.5, 0, 0})));
}

TEST(FreeSpace, waysKeepTheClearance) {
    FreeSpace space(kBox, 0.1);
    space.declareFreeOutside(
        Eigen::AlignedBox3d(Eigen::Vector3d(1, -0.5, -2), Eigen::Vector3d(2, 2, 2)));
    const Eigen::Vector3d start(0, 1, 0);
    const Eigen::Vector3d goal(3, 1, 0);
    space.updateClear(0.3, kBox);
    space.updateReach(start);
    ASSERT_TRUE(std::isfinite(space.distanceTo(goal)));
    EXPECT_TRUE(std::isinf(space.distanceTo({1.5, 1, 0})));
    EXPECT_TRUE(std::isinf(space.distanceTo({0.9, 1, 0})));  // nearer than the clearance
    const auto path = space.pathTo(goal);
    ASSERT_GE(path.size(), 3U);
    EXPECT_EQ(path.front(), start);
    EXPECT_LT((path.back() - goal).norm(), 0.1);
    double length = 0;
    const Eigen::AlignedBox3d block(Eigen::Vector3d(1, -0.5, -2), Eigen::Vector3d(2, 2, 2));
    for (std::size_t i = 1; i < path.size(); ++i) {
        length += (path[i] - path[i - 1]).norm();
        for (double s = 0; s <= 1; s += 0.02) {
            const Eigen::Vector3d p = path[i - 1] + s * (path[i] - path[i - 1]);
            EXPECT_GE(block.exteriorDistance(p), 0.3) << p.transpose();
        }
    }
    // Around the corner and back at least; cut corners are no longer than the voxel way.
    EXPECT_LE(length, space.distanceTo(goal) + 0.1);
    EXPECT_GT(length, 2 * std::hypot(1.5, 1.8) - 0.5);
}

TEST(FreeSpace, besideKnownSurfaceOnlyTheSurfaceIsInTheWay) {
    FreeSpace space(kBox, 0.1);
    const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(2.03));
    space.carve(view, sensorOf(view), false);
    const Eigen::Vector3d beside(1.8, 0, 0);
    EXPECT_TRUE(space.knownAround({1.2, 0, 0}, 0.2));
    EXPECT_FALSE(
        space.knownAround(beside, 0.22));  // voxels that are not free, and why is not known
    std::vector<Eigen::Vector3d> wall;
    for (double y = -1; y < 1; y += 0.02) {
        for (double z = -1; z < 1; z += 0.02) {
            wall.emplace_back(2.03, y, z);
        }
    }
    space.setSurface(wall);
    EXPECT_TRUE(space.knownAround(beside, 0.22));
    EXPECT_FALSE(space.knownAround({1.2, 0.75, 0}, 0.3));  // beside the field of view
    EXPECT_FALSE(space.knownAround({-1.95, 0, 0}, 0.3));   // reaches out of the grid
    space.updateClear(0.2, kBox);
    EXPECT_FALSE(space.isClear(beside));
    const auto clear = space.nearestClear(beside, 2, false);
    ASSERT_TRUE(clear);
    EXPECT_TRUE(space.isClear(*clear));
    EXPECT_LT((*clear - beside).norm(), 0.2);
    EXPECT_FALSE(space.nearestClear({3.5, 0, 0}, 2, false));
}

TEST(FreeSpace, theUnknownIsSeenThroughFreeSpaceOnly) {
    FreeSpace space(kBox, 0.1);
    const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(2.0));
    space.carve(view, sensorOf(view), false);
    const Eigen::Vector3d eye(0.5, 0, 0);
    const auto run = space.firstUnknown(eye, Eigen::Vector3d::UnitX(), 3.0);
    const double s = run.begin;
    EXPECT_NEAR(s, 1.5, 0.2);
    EXPECT_NEAR(run.end, 3.0, 0.2);
    space.setSurface({Eigen::Vector3d(1.65, 0.05, 0.05)});
    EXPECT_LT(
        space.firstUnknown(eye + Eigen::Vector3d(0, 0.05, 0.05), Eigen::Vector3d::UnitX(), 5.0)
            .begin,
        0);
    EXPECT_LT(space.firstUnknown(eye, Eigen::Vector3d::UnitX(), 1.0).begin, 0);
    const Eigen::Vector3d place = eye + s * Eigen::Vector3d::UnitX();
    for (int i = 0; i < FreeSpace::kTries; ++i) {
        space.noteTry(place);
    }
    EXPECT_LT(space.firstUnknown(eye, Eigen::Vector3d::UnitX(), s + 0.05).begin, 0);
}

TEST(SensorModel, putsTheTargetIntoTheMiddleOfTheTrueFieldOfView) {
    const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(3.0), 60);
    const SensorModel sensor = sensorOf(view);
    for (const Eigen::Vector3d& target :
         {Eigen::Vector3d(2, 1, 0), Eigen::Vector3d(-2, 1, 0.5), Eigen::Vector3d(1, -1, -1)}) {
        const Pose pose = sensor.lookingAt({0.1, 0.2, 0.3}, target);
        const Eigen::Vector2d uv = sensor.camera.project(pose.inverse() * target);
        EXPECT_NEAR(uv.x(), (60 + 255) / 2.0, 3.0);
        EXPECT_NEAR(uv.y(), sensor.camera.cy, 4.0);
        EXPECT_NEAR(pose.rotation(2, 0), 0.0, 1e-9);  // level horizon
    }
}

TEST(SensorModel, goodDepthFollowsTheNoise) {
    SensorModel sensor;
    sensor.camera = test::smallCamera();
    sensor.nearLimit = 0.3;
    sensor.farLimit = 6;
    EXPECT_NEAR(sensor.goodDepth(0.01), 0.8 * 0.01 * 210, 1e-9);  // spacing alone
    sensor.sigmaDisparity = 0.25;
    const double z = sensor.goodDepth(0.01);
    EXPECT_NEAR(sensor.camera.depthSigma(z, 0.25), 0.005, 1e-6);
}

TEST(FreeSpace, theFrontierIsTheSkinOfWhatIsUnknown) {
    const Eigen::AlignedBox3d box(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1));
    const Eigen::AlignedBox3d object(Eigen::Vector3d(-0.5, -0.5, -0.5),
                                     Eigen::Vector3d(0.5, 0.5, 0.5));
    FreeSpace space(box, 0.1);
    EXPECT_TRUE(space.frontier(box).empty());  // nothing was seen: nothing to look from
    space.declareFreeOutside(object);
    const auto frontier = space.frontier(object);
    EXPECT_EQ(frontier.size(), 1000U - 512U);  // the outermost layer of 10 x 10 x 10 voxels
    Eigen::Vector3f positive = Eigen::Vector3f::Zero();
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const FreeSpace::Frontier& f : frontier) {
        positive += f.area.cwiseMax(0.0F);
        sum += f.area;
        EXPECT_GT(f.area.dot(f.centre), 0.0F);  // out of the object
    }
    EXPECT_LT((positive - Eigen::Vector3f::Ones()).norm(), 1e-4F);  // each side has 1 m^2
    EXPECT_LT(sum.norm(), 1e-4F);

    // Surface is known; what was looked at in vain is given up.
    space.setSurface({{0.45, 0.05, 0.05}});
    EXPECT_EQ(space.frontier(object).size(), frontier.size() - 1);
    for (int i = 0; i < FreeSpace::kTries; ++i) {
        space.noteTry({-0.45, 0.05, 0.05});
    }
    EXPECT_EQ(space.frontier(object).size(), frontier.size() - 2);
}

TEST(FreeSpace, surfaceThatWasSeenHasNoFrontierBehindIt) {
    const Eigen::AlignedBox3d box(Eigen::Vector3d(1, -0.5, -0.5), Eigen::Vector3d(4, 0.5, 0.5));
    for (const double at : {3.03, 3.06}) {  // before and behind the middle of its voxels
        FreeSpace space(kBox, 0.1);
        const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(at));
        space.carve(view, sensorOf(view), false);
        std::vector<Eigen::Vector3d> wall;
        for (double y = -1; y < 1; y += 0.02) {
            for (double z = -1; z < 1; z += 0.02) {
                wall.emplace_back(at, y, z);
            }
        }
        // Where the middles of the voxels were seen, only the surface itself tells them from space.
        EXPECT_EQ(space.frontier(box).empty(), at < 3.05);
        space.setSurface(wall);
        EXPECT_TRUE(space.frontier(box).empty());
    }
}

}  // namespace
}  // namespace riftmap
