// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/object_memory.h"

#include <gtest/gtest.h>

#include "planner_scene.h"
#include "riftmap/graph/pixel_graph.h"

namespace riftmap {
namespace {

constexpr double kResolution = 0.02;

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
    memory.update(SurfaceSummary(0.08, 0.02), 0);  // before the first surface
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
    }
    void update() { memory.update(summary, 1e-4 * summary.area()); }

    PixelGraph graph{GraphOptions()};
    SurfaceSummary summary{4 * kResolution, kResolution};
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

TEST_F(Promises, newAreaCountsForFrontierAndTearsInProportion) {
    memory.frontierGain = came;
    memory.tearGain = 4 * came;
    update();
    EXPECT_NEAR(memory.frontier.share(), 0.2, 0.01);
    EXPECT_NEAR(memory.tears.share(), 0.2, 0.01);
}

}  // namespace
}  // namespace riftmap
