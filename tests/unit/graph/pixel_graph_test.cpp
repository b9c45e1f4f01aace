// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/graph/pixel_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <sstream>

#include "synthetic_views.h"

namespace riftmap {
namespace {

using synthetic::lookDown;
using synthetic::makeView;
using synthetic::Scene;
using synthetic::smallCamera;
using ::testing::HasSubstr;

GraphOptions paperOptions() {
    GraphOptions o;
    o.fusion = GraphOptions::Fusion::kFirst;
    o.typedOpenness = false;
    o.delta = 0.1;
    o.riftExtent = 0;
    return o;
}

Scene ground() {
    Scene s;
    s.plane({0, 0, 0}, {0, 0, 1});
    return s;
}

TEST(PixelGraph, FirstViewIsOneVertexAPixelAndTheGridOfEdges) {
    const auto view = makeView(ground(), smallCamera(), lookDown(0, 0, 1.5));
    for (const GraphOptions& options : {GraphOptions{}, paperOptions()}) {
        PixelGraph graph(options);
        const MergeResult result = graph.merge(view);
        EXPECT_EQ(result.rawPoints, 96U * 72U);
        EXPECT_EQ(result.newVertices, 96U * 72U);
        EXPECT_EQ(graph.vertexCount(), 96U * 72U);
        EXPECT_EQ(graph.edgeCount(), 95U * 72U + 96U * 71U);
        EXPECT_EQ(graph.rawPointCount(), 96U * 72U);
    }
}

TEST(PixelGraph, EdgesPerVertexOfAFirstViewAsInTable1) {
    PixelGraph graph;
    graph.merge(makeView(ground(), synthetic::standardCamera(), lookDown(0, 0, 1.5)));
    const double ratio =
        static_cast<double>(graph.edgeCount()) / static_cast<double>(graph.vertexCount());
    EXPECT_GE(ratio, 1.9);
    EXPECT_LE(ratio, 2.0);
}

TEST(PixelGraph, SameViewAgainAddsNothing) {
    Scene scene = ground();
    scene.box({-0.2, -0.2, 0}, {0.2, 0.2, 0.4}).sphere({0.5, 0.3, 0.2}, 0.2);
    const auto view = makeView(scene, smallCamera(192, 144), lookDown(0, 0, 1.5));
    for (const GraphOptions& options : {GraphOptions{}, paperOptions()}) {
        PixelGraph graph(options);
        graph.merge(view);
        const auto vertices = graph.vertexCount(), edges = graph.edgeCount();
        const double area = graph.surfaceArea();
        for (int i = 0; i < 3; ++i) {
            const MergeResult again = graph.merge(view);
            EXPECT_EQ(again.matched, again.rawPoints);
            EXPECT_EQ(again.newVertices, 0U);
            EXPECT_EQ(again.newEdges, 0U);
            EXPECT_EQ(again.deletedVertices, 0U);
            EXPECT_EQ(again.deletedEdges, 0U);
        }
        EXPECT_EQ(graph.vertexCount(), vertices);
        EXPECT_EQ(graph.edgeCount(), edges);
        EXPECT_NEAR(graph.surfaceArea(), area, 0.01 * area);
    }
}

TEST(PixelGraph, WeightIsTheSmallestSeen) {
    // The same two points at other noise: the smaller distance stays.
    const StereoCamera camera = smallCamera(8, 6);
    PixelGraph graph(paperOptions());
    auto view = makeView(ground(), camera, lookDown(0, 0, 1.0));
    graph.merge(view);
    const auto weightOf = [&] {
        float w = 0;
        graph.forEachEdge(0, [&](VertexId n, float weight) { w = n == 1 ? weight : w; });
        return w;
    };
    const float first = weightOf();
    EXPECT_GT(first, 0);
    view.disparity.disparity[0] *= 1.003F;
    graph.merge(view);
    EXPECT_LE(weightOf(), first);
    const float second = weightOf();
    view = makeView(ground(), camera, lookDown(0, 0, 1.0));
    graph.merge(view);
    EXPECT_FLOAT_EQ(weightOf(), second);
}

TEST(PixelGraph, NormalsLookAtTheCamera) {
    for (const GraphOptions& options : {GraphOptions{}, paperOptions()}) {
        PixelGraph graph(options);
        graph.merge(makeView(ground(), smallCamera(), lookDown(0.3, 0.1, 1.5)));
        graph.forEachVertex([&](VertexId id) { EXPECT_GT(graph.vertex(id).normal.z(), 0.999F); });
    }
}

TEST(PixelGraph, OpenVerticesByKind) {
    GraphOptions options;
    options.targetResolution = 0.05;
    Scene scene = ground();
    scene.patch({-0.3, -0.2, 0.5}, {0.6, 0, 0}, {0, 0.4, 0});
    auto view = makeView(scene, smallCamera(), lookDown(0, 0, 1.5));
    view.disparity.disparity[view.disparity.index(10, 10)] = kNoDisparity;
    view.disparity.firstColumn = 5;
    for (int r = 0; r < 72; ++r) {
        for (int c = 0; c < 5; ++c) {
            view.disparity.disparity[view.disparity.index(c, r)] = kNoDisparity;
        }
    }
    PixelGraph graph(options);
    graph.merge(view);
    const Pose toCamera = view.world_T_camera.inverse();
    std::size_t steps = 0;
    graph.forEachVertex([&](VertexId id) {
        const Eigen::Vector2d p =
            view.camera.project(toCamera * Eigen::Vector3d(graph.position(id).cast<double>()));
        const int c = static_cast<int>(std::lround(p.x())),
                  r = static_cast<int>(std::lround(p.y()));
        unsigned expected = c == 5 || c == 95 || r == 0 || r == 71 ? unsigned{kImageBorder} : 0U;
        if (std::abs(c - 10) + std::abs(r - 10) == 1) {
            expected |= kNoMatch;
        }
        EXPECT_EQ(graph.open(id) & ~unsigned{kDepthStep}, expected) << c << ' ' << r;
        steps += (graph.open(id) & kDepthStep) != 0 ? 1U : 0U;
    });
    EXPECT_GT(steps, 100U);
}

TEST(PixelGraph, ClosedOnceSeenClosed) {
    GraphOptions options;
    options.targetResolution = 0.05;
    PixelGraph graph(options);
    graph.merge(makeView(ground(), smallCamera(), lookDown(0, 0, 1.5)));
    const auto openIn = [&](float x0, float x1) {
        std::size_t n = 0;
        graph.forEachOpenVertexIn({x0, -0.3F, -1}, {x1, 0.3F, 1}, [&](VertexId) { ++n; });
        return n;
    };
    EXPECT_GT(openIn(0.8F, 1.2F), 0U);  // the right border
    graph.merge(makeView(ground(), smallCamera(), lookDown(0.9, 0, 1.5)));
    EXPECT_EQ(openIn(0.8F, 1.2F), 0U);
    graph.merge(makeView(ground(), smallCamera(), lookDown(0, 0, 1.5)));
    EXPECT_EQ(openIn(0.8F, 1.2F), 0U);
}

TEST(PixelGraph, TheRimStaysOpenWhenAFinerViewsInnerPixelsMeetItsVertices) {
    Scene scene = ground();  // a table's top
    scene.patch({-0.3, -0.3, 0.6}, {0.6, 0, 0}, {0, 0.6, 0});
    PixelGraph graph;
    graph.merge(makeView(scene, smallCamera(96, 72), lookDown(0, 0, 1.8)));
    graph.merge(makeView(scene, smallCamera(384, 288), lookDown(0, 0, 1.8)));
    std::set<int> torn;  // pieces of 5 cm of the edge x = 0.3 that hold an open vertex
    graph.forEachVertexIn({0.27F, -0.275F, 0.55F}, {0.33F, 0.275F, 0.65F}, [&](VertexId id) {
        if ((graph.open(id) & kDepthStep) != 0) {
            torn.insert(static_cast<int>(std::floor((graph.position(id).y() + 0.275F) / 0.05F)));
        }
    });
    EXPECT_EQ(torn.size(), 11U);
}

TEST(PixelGraph, ADenserMapIsClosedByTheViewThatGoesOnAroundIt) {
    PixelGraph graph;
    graph.merge(makeView(ground(), smallCamera(384, 288), lookDown(0, 0, 0.8)));
    const auto openAtBorder = [&] {
        int n = 0;
        graph.forEachVertexIn({-0.5F, -0.5F, -0.1F}, {0.5F, 0.5F, 0.1F}, [&](VertexId id) {
            n += (graph.open(id) & kImageBorder) != 0 ? 1 : 0;
        });
        return n;
    };
    EXPECT_GT(openAtBorder(), 1000);
    graph.merge(makeView(ground(), smallCamera(96, 72), lookDown(0, 0, 1.6)));
    EXPECT_EQ(openAtBorder(), 0);
}

TEST(PixelGraph, TooCoarseUntilSeenFromNearer) {
    PixelGraph graph;                                                         // 2 cm
    const auto far = makeView(ground(), smallCamera(), lookDown(0, 0, 1.7));  // 2.2 cm a pixel
    graph.merge(far);
    std::size_t coarse = 0;
    graph.forEachVertex([&](VertexId id) { coarse += (graph.open(id) & kTooCoarse) != 0; });
    EXPECT_EQ(coarse, graph.vertexCount());
    graph.merge(makeView(ground(), smallCamera(), lookDown(0, 0, 1.0)));
    std::size_t left = 0;
    graph.forEachVertexIn({-0.4F, -0.3F, -1}, {0.4F, 0.3F, 1},
                          [&](VertexId id) { left += (graph.open(id) & kTooCoarse) != 0; });
    EXPECT_EQ(left, 0U);
}

TEST(PixelGraph, ShallowFloorIsNoRift) {
    Scene scene = ground();
    const auto view =
        makeView(scene, synthetic::standardCamera(), lookAt({0, 0, 1.2}, {4, 0, 0.3}), {}, 7.0);
    PixelGraph graph;
    graph.merge(view);
    std::size_t steps = 0;
    graph.forEachVertex([&](VertexId id) { steps += (graph.open(id) & kDepthStep) != 0; });
    EXPECT_LT(steps, graph.vertexCount() / 1000);
}

TEST(PixelGraph, KnownTearIsFoundLookedIntoAndGone) {
    // A plate above the ground hides a strip of it from the first view.
    Scene scene = ground();
    scene.patch({-0.25, -0.2, 0.3}, {0.5, 0, 0}, {0, 0.4, 0});
    GraphOptions options;
    options.targetResolution = 0.05;
    options.riftExtent = 0;
    PixelGraph graph(options);
    const auto camera = smallCamera(192, 144);
    graph.merge(makeView(scene, camera, lookDown(0, 0, 1.5)));
    const auto stepsNear = [&] {
        std::size_t n = 0;
        graph.forEachOpenVertexIn({-0.45F, -0.4F, -0.02F}, {0.45F, 0.4F, 0.02F}, [&](VertexId id) {
            n += (graph.open(id) & kDepthStep) != 0 ? 1 : 0;
        });
        return n;
    };
    EXPECT_GT(stepsNear(), 50U);
    bool found = false;
    for (const Rift& rift : graph.rifts()) {
        found = found || ((rift.kinds & kDepthStep) != 0 && rift.highEdges > 100 &&
                          rift.centre.head<2>().norm() < 0.2F);
    }
    EXPECT_TRUE(found);
    const auto highEdges = [&] {
        std::size_t n = 0;
        for (const Rift& rift : graph.rifts()) {
            n += rift.highEdges;
        }
        return n;
    };
    const std::size_t before = highEdges();
    std::size_t deleted = 0;
    for (const double a : {0.0, 1.57, 3.14, 4.71}) {
        deleted +=
            graph
                .merge(makeView(scene, camera,
                                lookAt({0.9 * std::cos(a), 0.9 * std::sin(a), 0.5}, {0, 0, 0.1}),
                                {}, 2.5))
                .deletedEdges;
    }
    EXPECT_LT(stepsNear(), 10U);
    EXPECT_GT(deleted, before / 2);
}

TEST(PixelGraph, PaperModeFindsAndResolvesTheTear) {
    // A box wall: behind it ground that the first view cannot see.
    Scene scene = ground();
    scene.box({-0.05, -0.4, 0}, {0.05, 0.4, 0.4});
    PixelGraph graph(paperOptions());
    const auto camera = smallCamera(192, 144);
    graph.merge(makeView(scene, camera, lookAt({-1.2, 0, 1.0}, {0, 0, 0.2}), {}, 2.5));
    ASSERT_FALSE(graph.rifts().empty());
    std::size_t before = 0;
    for (const Rift& r : graph.rifts()) {
        before = std::max(before, r.highEdges);
    }
    EXPECT_GT(before, 20U);
    MergeResult total;
    for (const double x : {-0.8, -0.4, 0.0, 0.4, 0.8}) {
        total.deletedEdges +=
            graph.merge(makeView(scene, camera, lookDown(x, 0, 1.5))).deletedEdges;
    }
    EXPECT_GT(total.deletedEdges, before / 2);
}

TEST(PixelGraph, SaveAndLoadGiveTheSameGraph) {
    Scene scene = ground();
    scene.sphere({0, 0, 0.2}, 0.3).box({0.5, 0, 0}, {0.7, 0.3, 0.3});
    PixelGraph graph;
    for (const double x : {0.0, 0.3, 0.6}) {
        graph.merge(makeView(scene, smallCamera(), lookDown(x, 0, 1.5), {0.05, 3}));
    }
    std::stringstream file;
    graph.save(file);
    PixelGraph back;
    back.load(file);
    EXPECT_EQ(back.vertexCount(), graph.vertexCount());
    EXPECT_EQ(back.edgeCount(), graph.edgeCount());
    EXPECT_EQ(back.rawPointCount(), graph.rawPointCount());
    EXPECT_DOUBLE_EQ(back.surfaceArea(), graph.surfaceArea());
    ASSERT_EQ(back.rifts().size(), graph.rifts().size());
    for (std::size_t i = 0; i < graph.rifts().size(); ++i) {
        EXPECT_EQ(back.rifts()[i].id, graph.rifts()[i].id);
        EXPECT_EQ(back.rifts()[i].vertices, graph.rifts()[i].vertices);
    }
    // Both go on alike, byte for byte.
    const auto next = makeView(scene, smallCamera(), lookDown(0.9, 0.2, 1.4), {0.05, 9});
    graph.merge(next);
    back.merge(next);
    std::stringstream a, b;
    graph.save(a);
    back.save(b);
    EXPECT_TRUE(a.str() == b.str());
}

TEST(PixelGraph, DamagedBlockIsNamedAndTheOthersLoad) {
    PixelGraph graph;
    graph.merge(makeView(ground(), smallCamera(), lookDown(0, 0, 1.5)));
    std::stringstream file;
    graph.save(file);
    std::string bytes = file.str();
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x10);
    std::stringstream damaged(bytes);
    PixelGraph back;
    try {
        back.load(damaged);
        FAIL() << "damage not noticed";
    } catch (const DamagedMapError& e) {
        EXPECT_THAT(e.what(), HasSubstr("block "));
        EXPECT_THAT(e.what(), HasSubstr("checksum"));
    }
    EXPECT_GT(back.vertexCount(), graph.vertexCount() / 2);
    EXPECT_LT(back.vertexCount(), graph.vertexCount());
    back.forEachVertex([&](VertexId id) {
        back.forEachEdge(id, [&](VertexId n, float) { EXPECT_TRUE(back.alive(n)); });
    });
    back.rifts();

    std::stringstream cut(file.str().substr(0, bytes.size() * 2 / 3));
    EXPECT_THROW(back.load(cut), DamagedMapError);
    std::stringstream empty;
    EXPECT_THROW(back.load(empty), std::runtime_error);
    std::stringstream other("this is some other file, long enough to have a head of ours");
    EXPECT_THROW(back.load(other), std::runtime_error);
}

TEST(PixelGraph, BadViewsAreNamedAndChangeNothing) {
    PixelGraph graph;
    const auto good = makeView(ground(), smallCamera(), lookDown(0, 0, 1.5));
    const auto errorOf = [&](const View& view) -> std::string {
        try {
            graph.merge(view);
        } catch (const std::invalid_argument& e) {
            return e.what();
        }
        return "";
    };
    View bad = good;
    bad.camera.fx = 0;
    EXPECT_THAT(errorOf(bad), HasSubstr("fx"));
    bad = good;
    bad.world_T_camera.translation.x() = std::nan("");
    EXPECT_THAT(errorOf(bad), HasSubstr("pose"));
    bad = good;
    bad.disparity.resize(10, 10);
    EXPECT_THAT(errorOf(bad), HasSubstr("10 x 10"));
    bad = good;
    bad.image = cv::Mat(5, 5, CV_8UC1);
    EXPECT_THAT(errorOf(bad), HasSubstr("5 x 5"));
    EXPECT_EQ(graph.vertexCount(), 0U);
}

TEST(PixelGraph, NearestAndBoxAgreeWithBruteForce) {
    Scene scene = ground();
    scene.sphere({0, 0, 0.2}, 0.3);
    PixelGraph graph;
    Scene before = scene;
    before.sphere({0.4, 0.3, 0.4}, 0.15);
    scene.sphere({0.44, 0.3, 0.41}, 0.1);  // smaller: pages keep places of vertices deleted
    graph.merge(makeView(before, smallCamera(), lookDown(0, 0, 1.5)));
    std::size_t deleted = 0;
    for (int i = 0; i < 8; ++i) {
        deleted +=
            graph.merge(makeView(scene, smallCamera(), lookDown(0.01 * i, 0, 1.5))).deletedVertices;
    }
    EXPECT_GT(deleted, 50U);
    std::mt19937 random(7);
    std::uniform_real_distribution<float> in(-1.2F, 1.2F);
    for (int i = 0; i < 200; ++i) {
        Eigen::Vector3f p(in(random), in(random), 0.5F * in(random));
        float radius = std::abs(0.1F + 0.1F * in(random));
        if (i % 2 == 0) {  // where vertices were deleted
            p = Eigen::Vector3f(0.3F, 0.3F, 0.45F) + 0.1F * p;
            radius *= 0.25F;
        } else if (i % 8 == 1) {
            radius = 10;  // all of it
        }
        std::optional<VertexId> expected;
        float least = radius * radius;
        std::set<VertexId> inBox;
        graph.forEachVertex([&](VertexId id) {
            const Eigen::Vector3f d = graph.position(id) - p;
            const float squared = (d.x() * d.x() + d.y() * d.y()) + d.z() * d.z();
            if (squared < least || (squared == least && (!expected || id < *expected))) {
                least = squared;
                expected = id;
            }
            if (d.cwiseAbs().maxCoeff() <= 0.1F) {
                inBox.insert(id);
            }
        });
        EXPECT_EQ(graph.nearest(p, radius), expected);
        if (expected) {  // the limit itself counts
            EXPECT_TRUE(graph.nearest(graph.position(*expected), 0.0F));
            EXPECT_TRUE(graph.anyWithin(graph.position(*expected), 0.0F));
        }
        EXPECT_EQ(graph.anyWithin(p, radius), expected.has_value());
        std::set<VertexId> found;
        graph.forEachVertexIn(p - Eigen::Vector3f::Constant(0.1F),
                              p + Eigen::Vector3f::Constant(0.1F),
                              [&](VertexId id) { found.insert(id); });
        EXPECT_NEAR(static_cast<double>(found.size()), static_cast<double>(inBox.size()), 1);
    }
}

}  // namespace
}  // namespace riftmap
