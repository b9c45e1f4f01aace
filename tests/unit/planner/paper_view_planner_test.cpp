// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/paper_view_planner.h"

#include <gtest/gtest.h>

#include "planner_scene.h"

namespace riftmap {
namespace {

/// A wall two metres ahead, seen once: nothing but the camera's own place is known to be free
/// enough, and the paper's poses lie a metre before the wall.
class PaperBeforeWall : public testing::Test {
 protected:
    void see(const Pose& pose) {
        const View view = test::viewOf(pose, test::wall(2.0));
        graph.merge(view);
        knowledge.update(view);
        knowledge.updateReach();
    }
    static PlatformLimits limits() {
        PlatformLimits limits;
        limits.boxMin = Eigen::Vector3d(-1, -2, -2);
        limits.boxMax = Eigen::Vector3d(3, 2, 2);
        limits.clearance = 0.25;
        limits.farLimit = 6;
        return limits;
    }

    PixelGraph graph{test::graphOptions(0.05)};
    Knowledge knowledge{graph, limits(), {}};
    PaperViewPlanner planner{PaperPlannerOptions{}};
};

TEST_F(PaperBeforeWall, looksAtTheDominantRiftFromWhereItCanGo) {
    see(lookAt({0, 0, 0}, {1, 0, 0}));
    const PaperPlan paper = planPaper(graph, knowledge.camera(), PaperPlannerOptions{});
    ASSERT_NE(paper.dominant, PaperPlan::kNone);
    for (const Pose& pose : paper.poses) {
        ASSERT_FALSE(knowledge.placeAt(pose.translation)) << "the test needs one out of reach";
    }
    const auto plan = planner.next(knowledge);
    ASSERT_TRUE(plan);
    const Pose& view = plan->path.back();
    const auto place = knowledge.placeAt(view.translation);
    ASSERT_TRUE(place);
    EXPECT_LT((place->eye - view.translation).norm(), 1e-9);
    const Eigen::Vector3d wanted = paper.poses.back().translation;
    for (const Eigen::Vector3d& other : knowledge.space().reachable(1)) {
        EXPECT_GE((other - wanted).norm(),
                  (view.translation - wanted).norm() - knowledge.space().voxelSize());
    }
    const Eigen::Vector3d centre = graph.rifts()[paper.dominant].centre.cast<double>();
    EXPECT_GT(view.rotation.col(2).dot((centre - view.translation).normalized()), 0.999);
}

TEST_F(PaperBeforeWall, endsWithItsReasonWhenThatViewHasBeenTaken) {
    see(lookAt({0, 0, 0}, {1, 0, 0}));
    ASSERT_TRUE(planner.next(knowledge));
    EXPECT_FALSE(planner.next(knowledge));  // nothing has changed
    EXPECT_EQ(planner.whyNone(), "no_reachable_pose");
}

TEST_F(PaperBeforeWall, isCompleteWithoutARift) {
    EXPECT_FALSE(planner.next(knowledge));
    EXPECT_EQ(planner.whyNone(), "complete");
}

}  // namespace
}  // namespace riftmap
