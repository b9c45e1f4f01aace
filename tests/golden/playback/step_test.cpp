// SPDX-License-Identifier: BSD-3-Clause
// rawlogs/step.rawlog: a block of 80 cm on a floor, from the front, from above, from behind. What
// is expected follows from the world (x 1.3 .. 1.7, y -1.4 .. -0.7, z 0 .. 0.8), not from an
// earlier run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "riftmap/apps/rawlog_reader.h"
#include "riftmap/core/file.h"
#include "riftmap/core/tum.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/paper_planner.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {
namespace {

const std::filesystem::path kFolder = std::filesystem::path(RIFTMAP_SOURCE_DIR) / "rawlogs";

TEST(StepFixture, IsTheFileWhoseChecksumIsWrittenDown) {
    const auto sums = readFile(kFolder / "SHA256SUMS");
    for (const auto* name : {"step.rawlog", "step_gt.tum"}) {
        EXPECT_THAT(sums, ::testing::HasSubstr(sha256OfFile(kFolder / name) + "  " + name));
        EXPECT_LT(std::filesystem::file_size(kFolder / name), 1'000'000U);
    }
}

TEST(StepFixture, PosesAreTheTrueOnes) {
    const auto truth = readTum(kFolder / "step_gt.tum");
    RawlogReader reader(kFolder / "step.rawlog", {});
    for (const auto& expected : truth) {
        const auto observation = reader.next();
        ASSERT_TRUE(observation);
        EXPECT_EQ(observation->time_ns, expected.time_ns);
        EXPECT_LT((observation->world_T_camera.translation - expected.pose.translation).norm(),
                  1e-6);
        EXPECT_LT(angleBetween(observation->world_T_camera, expected.pose), 1e-6);
    }
    EXPECT_FALSE(reader.next());
}

/// The paper's stereo: what crosses a depth step is not discarded.
StereoOptions paperStereo() {
    StereoOptions options;
    options.silhouetteReach = 0;
    options.guard = 0;
    return options;
}

/// Its graph, with a threshold that suits the world.
GraphOptions paperGraph() {
    GraphOptions options;
    options.delta = 0.15;
    options.fusion = GraphOptions::Fusion::kFirst;
    options.typedOpenness = false;
    options.riftExtent = 0;
    return options;
}

/// At its back, which the two later views have in the picture.
bool onBlockTop(const Eigen::Vector3f& p) {
    return std::abs(p.x() - 1.5F) < 0.3F && p.y() < -0.6F && p.y() > -0.85F && p.z() > 0.6F;
}

bool onFloorBehind(const Eigen::Vector3f& p) {
    return p.y() > 0.0F && p.z() < 0.2F;
}

/// Edges that leap from the top of the block to the floor far behind it.
std::size_t edgesOverTheTear(const PixelGraph& graph) {
    std::size_t count = 0;
    graph.forEachVertex([&](VertexId id) {
        graph.forEachEdge(id, [&](VertexId other, float /*weight*/) {
            count += onBlockTop(graph.position(id)) && onFloorBehind(graph.position(other)) ? 1 : 0;
        });
    });
    return count;
}

bool anyRiftAtTheTear(const PixelGraph& graph) {
    return std::any_of(graph.rifts().begin(), graph.rifts().end(), [&](const Rift& rift) {
        const auto has = [&](bool (*where)(const Eigen::Vector3f&)) {
            return std::any_of(rift.vertices.begin(), rift.vertices.end(),
                               [&](VertexId id) { return where(graph.position(id)); });
        };
        return has(onBlockTop) && has(onFloorBehind);
    });
}

/// Distance to the block and the floor under it [m].
float distanceToTruth(const Eigen::Vector3f& p) {
    const Eigen::Vector3f centre(1.5F, -1.05F, 0.4F);
    const Eigen::Vector3f half(0.2F, 0.35F, 0.4F);
    const Eigen::Vector3f q = (p - centre).cwiseAbs() - half;
    const float block = q.cwiseMax(0).norm() + std::abs(std::min(q.maxCoeff(), 0.0F));
    return std::min(block, std::abs(p.z()));
}

TEST(StepFixture, TheTearBehindTheBlockIsFoundLookedIntoAndGone) {
    RawlogReader reader(kFolder / "step.rawlog", {});
    ViewBuilder builder(paperStereo());
    PixelGraph graph(paperGraph());
    std::size_t raw = 0;

    const auto first = reader.next();
    ASSERT_TRUE(first);
    raw += graph.merge(builder.build(*first)).rawPoints;
    EXPECT_EQ(graph.vertexCount(), raw);
    // Table I of the paper: 1.99 edges a vertex.
    const double perVertex =
        static_cast<double>(graph.edgeCount()) / static_cast<double>(graph.vertexCount());
    EXPECT_GT(perVertex, 1.9);
    EXPECT_LT(perVertex, 2.0);
    const auto before = edgesOverTheTear(graph);
    EXPECT_GT(before, 20U) << "the block is some 40 px wide";
    EXPECT_TRUE(anyRiftAtTheTear(graph));
    const auto plan = planPaper(graph, first->world_T_camera, {});
    EXPECT_NE(plan.dominant, PaperPlan::kNone);
    EXPECT_FALSE(plan.poses.empty());

    while (const auto observation = reader.next()) {
        raw += graph.merge(builder.build(*observation)).rawPoints;
    }
    EXPECT_LE(edgesOverTheTear(graph), before / 20) << "seen through from above and behind";
    EXPECT_FALSE(anyRiftAtTheTear(graph));
    EXPECT_EQ(graph.rawPointCount(), raw);
    EXPECT_LT(graph.vertexCount(), raw) << "what was seen twice is there once";

    // Around the block, away from the other blocks and the staircase.
    std::size_t all = 0;
    std::size_t near = 0;
    graph.forEachVertex([&](VertexId id) {
        const auto p = graph.position(id);
        if (p.x() > 1.1F && p.x() < 2.2F && p.y() < 0.3F) {
            ++all;
            near += distanceToTruth(p) < 0.05F ? 1 : 0;
        }
    });
    EXPECT_GT(all, 5000U);
    EXPECT_GT(static_cast<double>(near), 0.95 * static_cast<double>(all));
}

}  // namespace
}  // namespace riftmap
