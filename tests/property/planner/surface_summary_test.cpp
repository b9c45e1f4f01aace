// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/surface_summary.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <vector>

#include "random_scene.h"

namespace riftmap {
namespace {

constexpr double kCell = 0.08;
constexpr double kPart = kCell / 4;

using Parts = std::set<std::array<int, 3>>;

/// All parts of cells that hold a vertex, counted along the axes; of cells with `least` vertices.
Parts partsOf(const SurfaceSummary& summary, std::uint32_t least = 1) {
    Parts parts;
    for (const auto& [key, block] : summary.blocks()) {
        for (const SurfaceCell& cell : block.cells) {
            const Eigen::Vector3i at = 4 * SurfaceSummary::indexOf(cell.key);
            for (int bit = 0; bit < 64; ++bit) {
                if (cell.vertices >= least && (cell.parts >> bit & 1U) != 0) {
                    parts.insert({at.x() + bit % 4, at.y() + bit / 4 % 4, at.z() + bit / 16});
                }
            }
        }
    }
    return parts;
}

/// The same from the vertices themselves, in the blocks that were summed up.
Parts partsOf(const PixelGraph& graph, const SurfaceSummary& summary) {
    Parts parts;
    graph.forEachVertexIn(
        Eigen::Vector3f::Constant(-100), Eigen::Vector3f::Constant(100), [&](VertexId id) {
            const Eigen::Vector3d p = graph.position(id).cast<double>();
            const std::uint64_t block = SurfaceSummary::blockOf(summary.keyOf(p));
            const Eigen::Array3i at = (4 * (p.array() / kCell)).floor().cast<int>();
            if (std::binary_search(summary.changed().begin(), summary.changed().end(), block)) {
                parts.insert({at.x(), at.y(), at.z()});
            }
        });
    return parts;
}

std::size_t newIn(const Parts& now, const Parts& before) {
    std::size_t count = 0;
    for (const auto& p : now) {
        bool known = before.count(p) > 0;
        for (int axis = 0; axis < 3; ++axis) {
            for (const int side : {-1, 1}) {
                auto q = p;
                q[static_cast<std::size_t>(axis)] += side;
                known = known || before.count(q) > 0;
            }
        }
        count += known ? 0 : 1;
    }
    return count;
}

/// Whether a part lies on the line from a place to an eye, two parts to `reach` cells from the
/// place; nothing where rounding may decide.
std::optional<bool> closed(const Parts& parts, const Eigen::Vector3d& place,
                           const Eigen::Vector3d& eye, double reach) {
    bool doubt = false;
    for (double s = 2.2; s < std::min(4 * reach, (eye - place).norm() / kPart); s += 0.75) {
        const Eigen::Vector3d p = place / kPart + s * (eye - place).normalized();
        const Eigen::Vector3d whole = p.array().floor();
        const bool atBorder = ((p - whole).array() - 0.5).abs().maxCoeff() > 0.5 - 1e-3;
        const bool met = parts.count({static_cast<int>(whole.x()), static_cast<int>(whole.y()),
                                      static_cast<int>(whole.z())}) > 0;
        doubt = doubt || atBorder;
        if (met && !atBorder) {
            return true;
        }
    }
    return doubt ? std::nullopt : std::optional(false);
}

TEST(SurfaceSummary, IsOpenTowardsAnEyeUnlessAPartIsOnTheWay) {
    for (std::uint32_t seed = 1; seed <= 6; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        test::RandomScene scene(seed);
        PixelGraph graph{GraphOptions()};
        SurfaceSummary summary(kCell, kPart);
        std::vector<Eigen::Vector3f> vertices;
        for (const double y : {-0.5, 0.5}) {
            const View view = scene.see(lookAt({0, y, 0}, {2.5, 0, 0}));
            graph.merge(view);
            summary.update(graph, view);
        }
        if (seed % 2 == 0) {  // so far off that the blocks are not spread over a grid
            View far = scene.see(lookAt({0, 0, 0}, {2.5, 0, 0}));
            far.world_T_camera.translation += Eigen::Vector3d::Constant(100);
            graph.merge(far);
            summary.update(graph, far);
        }
        graph.forEachVertex([&](VertexId id) { vertices.push_back(graph.position(id)); });
        const Parts parts = partsOf(summary, 3);
        ASSERT_LT(parts.size(), partsOf(summary).size()) << "the test needs single vertices";
        std::array<std::size_t, 2> count{};
        for (int i = 0; i < 3000; ++i) {
            const float reach = i % 2 == 0 ? 4.0F : std::numeric_limits<float>::infinity();
            const Eigen::Vector3d near = vertices[scene.random() % vertices.size()].cast<double>() +
                                         scene.place({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1});
            // Some eyes are nearer than looks go.
            const Eigen::Vector3d eye =
                near + scene.place({-1, -1, -1}, {1, 1, 1}) * scene.uniform(0.05, 2.0);
            const auto slow = closed(parts, near, eye, static_cast<double>(reach));
            if (slow) {
                EXPECT_NE(summary.openTowards(near.cast<float>(), eye.cast<float>(), reach), *slow)
                    << near.transpose() << " to " << eye.transpose();
                ++count[*slow ? 1 : 0];
            }
        }
        EXPECT_GT(count[0], 500U);
        EXPECT_GT(count[1], 500U);
    }
}

TEST(SurfaceSummary, NewAreaIsThatOfPartsWithNoneBesideThem) {
    for (std::uint32_t seed = 1; seed <= 6; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        test::RandomScene scene(seed);
        PixelGraph graph{GraphOptions()};
        SurfaceSummary summary(kCell, kPart);
        std::size_t some = 0;
        for (int i = 0; i < 5; ++i) {
            const Eigen::Vector3d eye = scene.place({-0.3, -0.8, -0.5}, {0.4, 0.8, 0.5});
            const View view =
                scene.see(lookAt(eye, scene.place({2.3, -0.6, -0.4}, {2.5, 0.6, 0.4})));
            const Parts before = partsOf(summary);
            graph.merge(view);
            summary.update(graph, view);
            const Parts now = partsOf(summary);
            const std::size_t count = newIn(now, before);
            EXPECT_DOUBLE_EQ(summary.newArea(), static_cast<double>(count) * kPart * kPart / 1.5);
            some += i > 0 && count > 0 ? 1 : 0;
            if (i == 0) {
                EXPECT_EQ(now, partsOf(graph, summary));
            }
        }
        EXPECT_GT(some, 0U);
    }
}

TEST(SurfaceSummary, NewAreaOfAWallIsItsAreaAndThenNothing) {
    PixelGraph graph{GraphOptions()};
    SurfaceSummary summary(kCell, kPart);
    // Aslant to all axes, a patch of 0.5 by 0.4 m nearly: 256 x 192 pixels at f = 210, 0.4 m away.
    const Eigen::Vector3d axis = Eigen::Vector3d(1.0, 0.7, -0.6).normalized();
    const auto wall = [&](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
        return std::optional((0.4 - o.dot(axis)) / d.dot(axis));
    };
    const View view = test::viewOf(lookAt(Eigen::Vector3d::Zero(), axis), wall);
    graph.merge(view);
    summary.update(graph, view);
    const double area = 256.0 * 192.0 * std::pow(0.4 / 210, 2);
    // A sheet with this normal crosses more parts than one does on average.
    const double more = axis.cwiseAbs().sum() / 1.5;
    EXPECT_NEAR(summary.newArea(), area * more, 0.06 * area);
    graph.merge(view);
    summary.update(graph, view);
    EXPECT_EQ(summary.newArea(), 0.0);
}

TEST(SurfaceSummary, HoldsSurfaceOnTheBorderOfBlocks) {
    // Rounding puts the points of the wall x = 0 on one side of it and the vertices on the other.
    // The wall y = 0 is seen from afar, one pixel in 2 cm of it.
    const auto vertical = [](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
        return d.y() < 1e-9 ? std::nullopt : std::optional(-o.y() / d.y());
    };
    const View across = test::viewOf(lookAt({0.1, -4, 0.1}, {0.1, 0, 0.1}), vertical);
    for (const double x : {-1e-6, 0.0, 1e-6}) {
        PixelGraph graph{GraphOptions()};
        SurfaceSummary summary(kCell, kPart);
        for (const View& view :
             {test::viewOf(lookAt({-1, 0, 0}, Eigen::Vector3d::Zero()), test::wall(x)), across}) {
            graph.merge(view);
            summary.update(graph, view);
        }
        std::size_t vertices = 0;
        for (const auto& [key, block] : summary.blocks()) {
            for (const SurfaceCell& cell : block.cells) {
                vertices += cell.vertices;
            }
        }
        EXPECT_EQ(vertices, graph.vertexCount()) << x;
    }
}

}  // namespace
}  // namespace riftmap
