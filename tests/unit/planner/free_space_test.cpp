// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/free_space.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <utility>

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
    space.carve(view, sensorOf(view), space.emptyPixels(view, sensorOf(view), false));
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
    all.carve(whole, sensorOf(whole), all.emptyPixels(whole, sensorOf(whole), false));
    cut.carve(strip, sensorOf(strip), cut.emptyPixels(strip, sensorOf(strip), false));
    const Eigen::Vector3d left(2.0, 0.9, 0.0);
    EXPECT_EQ(all.at(left), State::kFree);
    EXPECT_EQ(cut.at(left), State::kUnknown);
}

TEST(FreeSpace, pixelsWithoutAMatchAreKnownOnlyWhereTheBackgroundIsFree) {
    const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), [](const auto&, const auto&) {
        return std::optional<double>();
    });
    FreeSpace strict(kBox, 0.1);
    strict.carve(view, sensorOf(view), strict.emptyPixels(view, sensorOf(view), false));
    EXPECT_EQ(strict.at({1.5, 0, 0}), State::kUnknown);
    FreeSpace open(kBox, 0.1);
    open.carve(view, sensorOf(view), open.emptyPixels(view, sensorOf(view), true));
    EXPECT_EQ(open.at({1.5, 0, 0}), State::kFree);
    // Known, but not proven free to fly through.
    open.updateClear(0.0, kBox);
    open.updateReach({0, 0, 0});
    EXPECT_TRUE(std::isinf(open.distanceTo({1.5, 0, 0})));
}

/// The way ahead has no match, as before an open sky; the camera is at the origin.
class Sky : public testing::Test {
 protected:
    void lookAhead() {
        const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), [](const auto&, const auto&) {
            return std::optional<double>();
        });
        space.carve(view, sensor, space.emptyPixels(view, sensor, false));
    }
    /// A view across the first metre before the camera.
    void lookAcross() {
        const View view = test::viewOf(
            lookAt({0.5, -1.8, 0}, {0.5, 0, 0}),
            [](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
                return d.y() > 1e-9 ? std::optional((1.5 - o.y()) / d.y()) : std::nullopt;
            });
        space.carve(view, sensor, space.emptyPixels(view, sensor, false));
    }
    bool canFlyTo(const Eigen::Vector3d& place) {
        space.updateClear(0.0, kBox);
        space.updateReach({0.5, 0, 0});
        return std::isfinite(space.distanceTo(place));
    }

    FreeSpace space{kBox, 0.1};
    SensorModel sensor = [] {
        SensorModel s = sensorOf(test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(3)));
        s.nearLimit = 0.5;
        s.clearance = 0.1;
        s.depthKind = DepthKind::kExact;
        return s;
    }();
    const Eigen::Vector3d ahead{3, 0, 0};
};

TEST_F(Sky, isFreeToFlyInOnceNothingCanBeNearerThanTheRange) {
    lookAhead();  // a surface before the near limit has no match either
    EXPECT_EQ(space.at(ahead), State::kUnknown);
    lookAcross();
    lookAhead();
    EXPECT_EQ(space.at(ahead), State::kFree);
    EXPECT_TRUE(canFlyTo(ahead));
}

TEST_F(Sky, isUnknownIfAMatchMayHaveBeenMissed) {
    sensor.depthKind = DepthKind::kMatched;
    lookAcross();
    lookAhead();
    EXPECT_EQ(space.at(ahead), State::kUnknown);
}

TEST_F(Sky, isUnknownBehindWhatIsNearerThanTheRange) {
    lookAcross();
    space.addSurface({0.35, 0.02, 0.02});
    lookAhead();
    EXPECT_EQ(space.at(ahead), State::kUnknown);
}

TEST_F(Sky, isUnknownWhereAPixelMayHaveMissedWhatIsNear) {
    View across = test::viewOf(lookAt({0.5, -1.8, 0}, {0.5, 0, 0}), [](const Eigen::Vector3d& o,
                                                                       const Eigen::Vector3d& d) {
        return d.y() > 1e-9 ? std::optional((1.5 - o.y()) / d.y()) : std::nullopt;
    });
    // One pixel in each few has no match, as before a thin post: enough to fly, no proof.
    for (std::size_t i = 0; i < across.disparity.disparity.size(); i += 9) {
        across.disparity.disparity[i] = kNoDisparity;
    }
    space.carve(across, sensor, space.emptyPixels(across, sensor, false));
    EXPECT_TRUE(canFlyTo({0.5, 0.5, 0}));
    lookAhead();
    EXPECT_EQ(space.at(ahead), State::kUnknown);
}

TEST_F(Sky, thatTheCameraOnlyTookForFreeProvesNothing) {
    space.declareFree({0, 0, 0}, 0.8);  // so that it may take its first step
    lookAhead();
    EXPECT_EQ(space.at(ahead), State::kUnknown);
}

TEST(FreeSpace, waysLeadThroughPassagesThatOnlyTheSurfaceItselfShows) {
    FreeSpace space(kBox, 0.1);
    space.declareFreeOutside(
        Eigen::AlignedBox3d(Eigen::Vector3d(1, -2, -2), Eigen::Vector3d(2, 2, 2)));
    for (double x = 0.9; x < 2.15; x += 0.05) {
        space.declareFree({x, 0.05, 0.05}, 0.35);
    }
    space.updateClear(0.3, kBox);  // wants a voxel more than the passage has
    const Eigen::Vector3d start(0.05, 0.05, 0.05);
    const Eigen::Vector3d goal(3.05, 0.05, 0.05);
    const std::size_t reached = space.updateReach(start);
    EXPECT_TRUE(std::isinf(space.distanceTo(goal)));
    int asked = 0;
    const auto fits = [&](const Eigen::Vector3d& p) {
        ++asked;
        return std::hypot(p.y() - 0.05, p.z() - 0.05) < 0.04;
    };
    EXPECT_GT(space.updateReach(start, fits), reached + 100);
    EXPECT_LT(space.distanceTo(goal), 3.2);
    EXPECT_GT(asked, 10);

    asked = 0;
    space.updateReach(start, fits);
    EXPECT_EQ(asked, 0);  // nothing changed
    const Eigen::Vector3d middle(1.5, 0, 0);
    space.forget(Eigen::AlignedBox3d(middle, middle));
    space.updateReach(start, [](const auto&) { return false; });
    EXPECT_TRUE(std::isinf(space.distanceTo(goal)));
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
    space.carve(view, sensorOf(view), space.emptyPixels(view, sensorOf(view), false));
    const Eigen::Vector3d beside(1.8, 0, 0);
    EXPECT_TRUE(space.knownAround({1.2, 0, 0}, 0.2, false));
    EXPECT_FALSE(
        space.knownAround(beside, 0.22, false));  // voxels that are not free, and why is not known
    std::vector<Eigen::Vector3d> wall;
    for (double y = -1; y < 1; y += 0.02) {
        for (double z = -1; z < 1; z += 0.02) {
            wall.emplace_back(2.03, y, z);
        }
    }
    space.setSurface(wall);
    EXPECT_TRUE(space.knownAround(beside, 0.22, false));
    EXPECT_FALSE(space.knownAround({1.2, 0.75, 0}, 0.3, false));  // beside the field of view
    EXPECT_FALSE(space.knownAround({-1.95, 0, 0}, 0.3, false));   // reaches out of the grid
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
    space.carve(view, sensorOf(view), space.emptyPixels(view, sensorOf(view), false));
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

TEST(FreeSpace, looksWithoutAMatchMakeThoseAroundThemWorthLess) {
    FreeSpace space(kBox, 0.1);
    const Eigen::Vector3d place = space.snap({1, 0, 0});
    const Eigen::Vector3d far = place + Eigen::Vector3d(0.8, 0, 0);
    EXPECT_EQ(space.lookWorth(place), 1.0);
    double last = 1;
    for (int i = 0; i < 30; ++i) {
        space.noteLook(place, false);
        EXPECT_LE(space.lookWorth(place), last);
        last = space.lookWorth(place);
    }
    EXPECT_LT(last, 0.4);
    EXPECT_GT(last, 0);
    EXPECT_EQ(space.lookWorth(far), 1.0);
    for (int i = 0; i < 200; ++i) {
        space.noteLook(place, i % 5 < 4);
        space.noteLook(far, i % 5 < 3);  // as many as is usual
    }
    EXPECT_EQ(space.lookWorth(place), 1.0);
    EXPECT_EQ(space.lookWorth(far), 1.0);
    space.noteLook({99, 0, 0}, false);
    EXPECT_EQ(space.lookWorth({99, 0, 0}), 1.0);
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

TEST(SensorModel, knowsHowMuchOfWhatIsSeenFromAfarIsRight) {
    SensorModel sensor;
    sensor.camera = test::smallCamera();
    EXPECT_EQ(sensor.shareWithin(0.01, 5.0), 1.0);  // without noise
    sensor.sigmaDisparity = 0.25;
    const double oneSigma = sensor.camera.depthSigma(2.0, 0.25);
    EXPECT_NEAR(sensor.shareWithin(oneSigma, 2.0), 0.6827, 1e-4);
    EXPECT_NEAR(sensor.shareWithin(2 * oneSigma, 2.0), 0.9545, 1e-4);
    EXPECT_LT(sensor.shareWithin(oneSigma, 4.0), sensor.shareWithin(oneSigma, 2.0));
}

TEST(SensorModel, doesNotCountPixelsThatAreNoSurface) {
    View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(3.0));
    const double plain = sensorOf(view).sigmaDisparity;
    for (std::size_t i = 0; i < view.disparity.sigma.size(); ++i) {
        if (i % 3 != 0) {  // most of them
            view.disparity.sigma[i] = 0.4F * view.disparity.disparity[i];
        }
    }
    EXPECT_EQ(sensorOf(view).sigmaDisparity, plain);
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
        space.carve(view, sensorOf(view), space.emptyPixels(view, sensorOf(view), false));
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

TEST(FreeSpace, whatIsClearDependsOnWhatIsKnownNotOnTheWayThere) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto uniform = [&](double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(random);
    };
    const auto place = [&] {
        return Eigen::Vector3d(uniform(-1.2, 4.2), uniform(-2.2, 2.2), uniform(-2.2, 2.2));
    };
    const Eigen::AlignedBox3d limits(Eigen::Vector3d(-0.8, -1.5, -1.5),
                                     Eigen::Vector3d(3.5, 1.5, 1.5));
    FreeSpace grown(kBox, 0.1);
    std::vector<Eigen::Vector3d> surface;
    std::vector<View> views;
    std::vector<std::pair<Eigen::Vector3d, double>> balls;
    for (int round = 0; round < 12; ++round) {
        const Eigen::Vector3d eye(uniform(-0.5, 0.5), uniform(-1, 1), uniform(-1, 1));
        views.push_back(test::viewOf(lookAt(eye, eye + Eigen::Vector3d(1, uniform(-1, 1), 0)),
                                     test::wall(uniform(1.5, 3.5))));
        grown.carve(views.back(), sensorOf(views.back()),
                    grown.emptyPixels(views.back(), sensorOf(views.back()), false));
        balls.emplace_back(place(), uniform(0.2, 0.6));
        grown.declareFree(balls.back().first, balls.back().second);
        for (int i = 0; i < 40; ++i) {
            surface.push_back(place());
            grown.addSurface(surface.back());
        }
        for (int i = 0; i < 15; ++i) {
            std::swap(surface[random() % surface.size()], surface.back());
            grown.removeSurface(surface.back());
            surface.pop_back();
        }
        grown.updateClear(0.25, limits);
    }
    FreeSpace atOnce(kBox, 0.1);
    for (std::size_t i = 0; i < views.size(); ++i) {
        atOnce.carve(views[i], sensorOf(views[i]),
                     atOnce.emptyPixels(views[i], sensorOf(views[i]), false));
        atOnce.declareFree(balls[i].first, balls[i].second);
    }
    atOnce.setSurface(surface);
    atOnce.updateClear(0.25, limits);
    std::size_t clear = 0;
    for (double x = -0.95; x < 4; x += 0.1) {
        for (double y = -1.95; y < 2; y += 0.1) {
            for (double z = -1.95; z < 2; z += 0.1) {
                const Eigen::Vector3d p(x, y, z);
                ASSERT_EQ(grown.at(p), atOnce.at(p)) << p.transpose();
                ASSERT_EQ(grown.isClear(p), atOnce.isClear(p)) << p.transpose();
                clear += grown.isClear(p) ? 1 : 0;
            }
        }
    }
    EXPECT_GT(clear, 100U);
}

TEST(FreeSpace, carvingFindsEveryVoxelInView) {
    // Against a question for each voxel alone: is its middle before the wall and in the image?
    FreeSpace space(kBox, 0.1);
    const Pose pose = lookAt({0.3, 0.2, -0.1}, {1.2, 0.9, 0.5});
    const View view = test::viewOf(pose, test::wall(3.03), 20);
    const SensorModel sensor = sensorOf(view);
    space.carve(view, sensor, space.emptyPixels(view, sensor, false));
    const double ball = 0.087;
    std::size_t found = 0;
    for (double x = -0.95; x < 4; x += 0.1) {
        for (double y = -1.95; y < 2; y += 0.1) {
            for (double z = -1.95; z < 2; z += 0.1) {
                const Eigen::Vector3d p(x, y, z);
                const Eigen::Vector3d c = pose.inverse() * p;
                if (c.z() < 0.2 || c.z() > 5.9) {
                    continue;
                }
                const Eigen::Vector2d uv = view.camera.project(c);
                const double px = view.camera.fx * ball / c.z();
                const auto inside = [&](double margin) {
                    return uv.x() > 20 + margin && uv.x() < 255 - margin && uv.y() > margin &&
                           uv.y() < 191 - margin;
                };
                const double before = 3.03 - p.x();
                if (inside(px + 2) && before > 0.3) {
                    EXPECT_EQ(space.at(p), State::kFree) << p.transpose();
                    ++found;
                } else if (!inside(-1) || before < -0.06) {
                    EXPECT_EQ(space.at(p), State::kUnknown) << p.transpose();
                }
            }
        }
    }
    EXPECT_GT(found, 1000U);
}

}  // namespace
}  // namespace riftmap
