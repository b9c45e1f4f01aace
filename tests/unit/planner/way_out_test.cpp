// SPDX-License-Identifier: BSD-3-Clause
// How a camera leaves the place where it begins.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "planner_scene.h"
#include "riftmap/planner/view_planner.h"

namespace riftmap {
namespace {

const Eigen::Vector3d kHalf(2.5, 2.5, 1.5);

/// The inside of a room.
std::optional<double> insideRoom(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    return test::insideBox(kHalf, origin, ray);
}

PlatformLimits limits() {
    PlatformLimits limits;
    limits.boxMin = -kHalf;
    limits.boxMax = kHalf;
    limits.clearance = 0.2;
    limits.farLimit = 6;
    return limits;
}

/// Views until the camera can reach more than its own place; the last of 12 if it cannot.
int viewsToGetOut(unsigned seed, int firstColumn) {
    PixelGraph graph(test::graphOptions(0.05));
    PlannerOptions options;
    options.voxelSize = 0.08;
    options.seed = seed;
    Knowledge knowledge(graph, limits(), options);
    RiftPlanner planner;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> in(-1, 1);
    Pose pose = lookAt(Eigen::Vector3d(in(random), in(random), 0.5 * in(random)),
                       Eigen::Vector3d(2 * in(random), 2 * in(random), 0.3 * in(random)));
    std::vector<Eigen::Vector3d> looked;
    for (int views = 1; views <= 12; ++views) {
        const View view = test::viewOf(pose, insideRoom, firstColumn);
        graph.merge(view);
        knowledge.update(view);
        for (const Eigen::Vector3d& place : looked) {
            knowledge.unseen().noteTry(place);
        }
        knowledge.updateReach();
        if (knowledge.reached() > 1000) {
            return views;
        }
        const auto plan = planner.next(knowledge);
        if (!plan) {
            return 12;
        }
        pose = plan->path.back();
        looked = plan->unknown;
    }
    return 12;
}

TEST(WayOut, takesFewViewsThoughThePyramidIsNarrowerThanTheCamera) {
    for (unsigned seed = 1; seed <= 6; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        EXPECT_LE(viewsToGetOut(seed, 0), 5);
        EXPECT_LE(viewsToGetOut(seed, 48), 6);
    }
}

TEST(WayOut, isNotLookedForInsideOfAnObjectsBox) {
    PixelGraph graph(test::graphOptions(0.05));
    PlannerOptions options;
    options.surfaceBox = {-3, -3, -2, 3, 3, 2};
    Knowledge knowledge(graph, limits(), options);
    RiftPlanner planner;
    const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), insideRoom);
    graph.merge(view);
    knowledge.update(view);
    knowledge.updateReach();
    ASSERT_LT(knowledge.reached(), 64U);
    EXPECT_NO_THROW(planner.next(knowledge));
}

TEST(WayOut, isBlockedByWhatEqualsTheVoxelsAlongIt) {
    const Eigen::AlignedBox3d box(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1));
    constexpr double kVoxel = 0.1;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> in(-0.9, 0.9);
    const auto place = [&] { return Eigen::Vector3d(in(random), in(random), in(random)); };
    for (int round = 0; round < 50; ++round) {
        SCOPED_TRACE("seed 7, round " + std::to_string(round));
        FreeSpace space(box, kVoxel);
        for (int i = 0; i < 6; ++i) {
            space.declareFree(place(), 0.5);
        }
        const Eigen::Vector3d from = place();
        const Eigen::Vector3d to = place();
        std::vector<Eigen::Vector3d> expected;
        for (int z = 0; z < 20; ++z) {
            for (int y = 0; y < 20; ++y) {
                for (int x = 0; x < 20; ++x) {
                    const Eigen::Vector3d p =
                        box.min() + kVoxel * (Eigen::Vector3d(x, y, z).array() + 0.5).matrix();
                    double nearest = 10;
                    for (int i = 0; i <= 1000; ++i) {
                        nearest = std::min(nearest, (p - from - i / 1000.0 * (to - from)).norm());
                    }
                    if (nearest < 0.3 && space.at(p) != FreeSpace::State::kFree) {
                        expected.push_back(p);
                    }
                }
            }
        }
        const auto found = space.toBeLookedAt(from, to, 0.3);
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t i = 0; i < found.size(); ++i) {
            EXPECT_LT((found[i] - expected[i]).norm(), 1e-9);
        }
        if (found.empty()) {
            continue;
        }
        space.noteTry(found.front());
        EXPECT_FALSE(space.toBeLookedAt(from, to, 0.3).empty());
        space.noteTry(found.front());
        EXPECT_TRUE(space.toBeLookedAt(from, to, 0.3).empty()) << "looked at in vain";
    }
    FreeSpace space(box, kVoxel);
    EXPECT_FALSE(space.toBeLookedAt({0.5, 0, 0}, {0.5, 0, 0}, 0.3).empty()) << "a way of no length";
    space.addSurface({0.05, 0.05, 0.05});
    EXPECT_TRUE(space.toBeLookedAt({-0.5, 0, 0}, {0.5, 0, 0}, 0.3).empty()) << "surface";
    EXPECT_FALSE(space.toBeLookedAt({-0.5, 0.6, 0}, {0.5, 0.6, 0}, 0.3).empty());
}

}  // namespace
}  // namespace riftmap
