// SPDX-License-Identifier: BSD-3-Clause
// The fast code against slow, obvious code, on random input. A failure prints its seed.
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <map>
#include <queue>
#include <random>
#include <set>
#include <sstream>

#include "association.h"
#include "normals.h"
#include "random_scenes.h"
#include "riftmap/graph/pixel_graph.h"
#include "visibility.h"

namespace riftmap {
namespace {

using synthetic::makeView;
using synthetic::Scene;

/// Algorithm 1 as the paper writes it, seed by seed, and its sibling for open vertices.
class SlowRifts {
 public:
    explicit SlowRifts(const PixelGraph& graph) : graph_(graph) {}

    std::set<std::set<VertexId>> find() const {
        std::set<std::set<VertexId>> rifts;
        std::set<VertexId> done;
        graph_.forEachVertex([&](VertexId seed) {
            if (!member(seed) || done.count(seed) > 0) {
                return;
            }
            std::set<VertexId> rift = {seed};
            std::queue<VertexId> toVisit;
            toVisit.push(seed);
            while (!toVisit.empty()) {
                const VertexId v = toVisit.front();
                toVisit.pop();
                for (const VertexId n : reachable(v)) {
                    if (member(n) && cell(n) == cell(seed) && rift.insert(n).second) {
                        toVisit.push(n);
                    }
                }
            }
            done.insert(rift.begin(), rift.end());
            rifts.insert(rift);
        });
        return rifts;
    }

 private:
    bool member(VertexId id) const {
        if (graph_.options().typedOpenness) {
            return graph_.open(id) != 0;
        }
        bool high = false;
        graph_.forEachEdge(id,
                           [&](VertexId n, float w) { high = high || graph_.isHigh(id, n, w); });
        return high;
    }
    /// Neighbours; with typed openness also theirs, through vertices of the cell.
    std::set<VertexId> reachable(VertexId v) const {
        std::set<VertexId> all;
        graph_.forEachEdge(v, [&](VertexId n, float) {
            all.insert(n);
            if (graph_.options().typedOpenness && cell(n) == cell(v)) {
                graph_.forEachEdge(n, [&](VertexId m, float) { all.insert(m); });
            }
        });
        return all;
    }
    std::array<int, 3> cell(VertexId id) const {
        const GraphOptions& o = graph_.options();
        if (o.riftExtent <= 0) {
            return {0, 0, 0};
        }
        const GraphStorage& s = graph_.storage();
        const auto& key = s.blocks()[s.page(GraphStorage::pageOf(id)).block].key;
        // Of the block's lowest corner.
        const double cells = std::exp2(key[3]) / std::round(o.riftExtent / o.blockSize);
        return {static_cast<int>(std::floor(key[0] * cells)),
                static_cast<int>(std::floor(key[1] * cells)),
                static_cast<int>(std::floor(key[2] * cells))};
    }
    const PixelGraph& graph_;
};

TEST(GraphProperty, RiftsKeptUpToDateAreThoseOfAlgorithm1FromScratch) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const Scene scene = randomScene(random);
        PixelGraph graph(randomOptions(random));
        for (int step = 0; step < 6; ++step) {
            graph.merge(randomView(random, scene));
            if (random.below(3) == 0) {
                continue;  // several views at once are caught up with too
            }
            std::set<std::set<VertexId>> fast;
            std::uint32_t last = 0;
            for (const Rift& rift : graph.rifts()) {
                EXPECT_TRUE(rift.id >= last) << "ordered by id";
                last = rift.id;
                EXPECT_TRUE(std::is_sorted(rift.vertices.begin(), rift.vertices.end()));
                const std::set<VertexId> own(rift.vertices.begin(), rift.vertices.end());
                std::set<std::pair<VertexId, VertexId>> high;
                Eigen::Vector3d centre = Eigen::Vector3d::Zero();
                unsigned kinds = 0;
                for (const VertexId v : own) {
                    centre += graph.position(v).cast<double>();
                    kinds |= graph.open(v);
                    graph.forEachEdge(v, [&](VertexId n, float w) {
                        if (graph.isHigh(v, n, w)) {
                            high.emplace(std::min(v, n), std::max(v, n));
                        }
                    });
                }
                EXPECT_EQ(rift.highEdges, high.size());
                EXPECT_EQ(rift.kinds, kinds);
                EXPECT_LT(
                    (centre / static_cast<double>(own.size()) - rift.centre.cast<double>()).norm(),
                    1e-5);
                fast.insert(own);
            }
            EXPECT_TRUE(fast == SlowRifts(graph).find()) << "after view " << step;
        }
    }
}

TEST(GraphProperty, AssociationFindsTheBestVertexOfTheWholeMap) {
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const Scene scene = randomScene(random);
        GraphOptions options = randomOptions(random);
        options.gamma = random.in(0.005, 0.05);
        PixelGraph graph(options);
        // Coarser, as fine and finer than the view that is matched.
        for (const int width : {16, 32, random.below(2) == 0 ? 24 : 96}) {
            graph.merge(randomView(random, scene, width));
        }
        const View view = randomView(random, scene);
        ViewPoints points;
        points.build(view, options);
        Association fast;
        fast.project(graph.storage(), points, options);
        fast.match(points, options);
        const Pose toCamera = view.world_T_camera.inverse();
        const bool paper = options.fusion == GraphOptions::Fusion::kFirst;
        struct Seen {
            VertexId id;
            Eigen::Vector3d p;
            Eigen::Vector2d px;
            double sigma;
        };
        std::vector<Seen> map;
        graph.forEachVertex([&](VertexId id) {
            const Eigen::Vector3d p = toCamera * Eigen::Vector3d(graph.position(id).cast<double>());
            if (p.z() > 0.01) {
                map.push_back(
                    {id, p, view.camera.project(p), static_cast<double>(graph.vertex(id).sigma)});
            }
        });
        std::size_t matched = 0;
        for (int r = 0; r < 48; r += 3) {
            for (int c = 0; c < 64; c += 2) {
                const std::size_t i = points.index(c, r);
                if (!(points.z[i] > 0)) {
                    EXPECT_EQ(fast.matchOf[i], Association::kNone);
                    continue;
                }
                const Gate gate = Association::gate(points, i, options);
                const Eigen::Vector3d point = points.inCamera(c, r, points.z[i]).cast<double>();
                // Negative: beyond the gate by that much.
                const auto distanceTo = [&](const Seen& s, double& inside) {
                    if (paper) {
                        const double d = (s.p - point).norm() / options.gamma;
                        inside = 1 - d;
                        return d;
                    }
                    const double lateral = (s.px - Eigen::Vector2d(c, r)).norm() * point.z() *
                                           points.footprint / gate.lateral;
                    const double noise = kNoiseGate * std::hypot(points.sigma[i], s.sigma);
                    const double along =
                        std::abs(s.p.z() - point.z()) / std::max<double>(gate.depth, noise);
                    // Only vertices within two pixels of the image take part.
                    const double border = std::min(
                        {s.px.x() + 2.5, s.px.y() + 2.5, 65.5 - s.px.x(), 49.5 - s.px.y()});
                    inside = std::min({1 - lateral, 1 - along, border});
                    return std::sqrt(lateral * lateral + kDepthShare * along * along);
                };
                double best = 1e9, surely = -1e9;
                for (const Seen& s : map) {
                    double inside = 0;
                    const double d = distanceTo(s, inside);
                    surely = std::max(surely, inside);
                    if (inside > 1e-3) {
                        best = std::min(best, d);
                    }
                }
                if (fast.matchOf[i] == Association::kNone) {
                    EXPECT_LT(surely, 1e-3) << "pixel " << c << ' ' << r;
                    continue;
                }
                ++matched;
                const VertexId id = fast.idOf(fast.matchOf[i]);
                const auto it =
                    std::find_if(map.begin(), map.end(), [&](const Seen& s) { return s.id == id; });
                ASSERT_NE(it, map.end());
                double inside = 0;
                const double d = distanceTo(*it, inside);
                EXPECT_GT(inside, -1e-3);
                EXPECT_LT(d, best + 2e-3) << "pixel " << c << ' ' << r;
            }
        }
        EXPECT_GT(matched, 0U);
    }
}

TEST(GraphProperty, VisibilityIsEquations5To8) {
    GraphOptions options;
    options.fusion = GraphOptions::Fusion::kFirst;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const Scene scene = randomScene(random);
        const View view = randomView(random, scene);
        ViewPoints points;
        points.build(view, options);
        std::size_t through = 0;
        for (int i = 0; i < 2000; ++i) {
            const auto end = [&] {
                const double z = random.in(0.3, 3.0);
                return view.camera.backProject(random.in(-5, 68), random.in(-5, 52),
                                               view.camera.disparity(z));
            };
            const Eigen::Vector3d a = end(), b = end();
            // Step finely along the edge in space; the pixels it meets are Bresenham's, nearly.
            const Eigen::Vector2d pa = view.camera.project(a), pb = view.camera.project(b);
            int tested = 0, surely = 0, perhaps = 0;
            forEachLinePixel(
                static_cast<int>(std::lround(pa.x())), static_cast<int>(std::lround(pa.y())),
                static_cast<int>(std::lround(pb.x())), static_cast<int>(std::lround(pb.y())),
                [&](int c, int r) {
                    ++tested;
                    if (c < 0 || r < 0 || c >= 64 || r >= 48 ||
                        !(points.z[points.index(c, r)] > 0)) {
                        return;
                    }
                    // p_e: the edge's point nearest to this pixel's ray, by search.
                    Eigen::Vector3d edgePoint = a;
                    double least = 1e9;
                    for (int k = 0; k <= 400; ++k) {
                        const Eigen::Vector3d p = a + (b - a) * (k / 400.0);
                        const double d = (view.camera.project(p) - Eigen::Vector2d(c, r)).norm();
                        if (d < least) {
                            least = d;
                            edgePoint = p;
                        }
                    }
                    const double dEdge = edgePoint.norm();  // eq. (7)
                    const double dPixel =                   // eq. (8)
                        points.inCamera(c, r, points.z[points.index(c, r)]).cast<double>().norm();
                    const double blur = 0.02 * dEdge;  // steps, rounding to pixels
                    surely += dEdge + blur < dPixel ? 1 : 0;
                    perhaps += dEdge - blur < dPixel ? 1 : 0;
                });
            const bool fast = seenThrough(points, a.cast<float>(), b.cast<float>(), options);
            if (surely > options.visibility * tested) {
                EXPECT_TRUE(fast) << "edge " << i;
            }
            if (perhaps <= options.visibility * tested) {
                EXPECT_FALSE(fast) << "edge " << i;
            }
            through += fast ? 1 : 0;
        }
        EXPECT_GT(through, 50U);
        EXPECT_LT(through, 1950U);
    }
}

TEST(GraphProperty, StorageIsAMapOfSets) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        GraphStorage storage(0.5);
        std::map<VertexId, std::map<VertexId, std::uint16_t>> slow;
        std::size_t edges = 0;
        const auto any = [&] {
            auto it = slow.begin();
            std::advance(it, random.below(static_cast<int>(slow.size())));
            return it->first;
        };
        for (int step = 0; step < 4000; ++step) {
            const int what = random.below(10);
            if (what < 3 || slow.size() < 4) {
                const Eigen::Vector3f p = random.point(0.8).cast<float>();
                const VertexId id = storage.addVertex(storage.blockAt(storage.keyOf(p)));
                EXPECT_TRUE(slow.emplace(id, std::map<VertexId, std::uint16_t>{}).second);
                Page& page = storage.page(GraphStorage::pageOf(id));
                page.x[GraphStorage::slotOf(id)] = p.x();
            } else if (what < 8) {
                const VertexId a = any(), b = any();
                if (a != b && slow[a].count(b) == 0) {
                    const auto w = static_cast<std::uint16_t>(random.below(30000));
                    storage.addEdge(a, b, w);
                    slow[a][b] = slow[b][a] = w;
                    ++edges;
                }
            } else if (what == 8) {
                const VertexId a = any(), b = any();
                EXPECT_EQ(storage.removeEdge(a, b), slow[a].count(b) > 0);
                edges -= slow[a].erase(b);
                slow[b].erase(a);
            } else if (random.below(3) == 0) {
                const VertexId a = any();
                edges -= slow[a].size();
                for (const auto& [n, w] : slow[a]) {
                    slow[n].erase(a);
                }
                slow.erase(a);
                storage.removeVertex(a);
                EXPECT_FALSE(storage.alive(a));
            }
        }
        EXPECT_EQ(storage.vertexCount(), slow.size());
        EXPECT_EQ(storage.edgeCount(), edges);
        auto expected = slow.begin();
        storage.forEachVertex([&](VertexId id) {
            ASSERT_EQ(id, expected->first);
            std::map<VertexId, std::uint16_t> found;
            storage.forEachHalfEdge(id, [&](VertexId n, std::uint16_t w) { found[n] = w; });
            EXPECT_EQ(found, expected->second);
            EXPECT_EQ(storage.degree(id), expected->second.size());
            for (const auto& [n, w] : found) {
                ASSERT_NE(storage.findHalfEdge(id, n), nullptr);
                EXPECT_EQ(*storage.findHalfEdge(id, n), w);
            }
            ++expected;
        });
    }
}

TEST(GraphProperty, NormalIsTheSmallestSingularVector) {
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        GraphStorage storage(0.5);
        const Eigen::Vector3d n = random.point(1).normalized();
        const Eigen::Vector3d u = n.unitOrthogonal(), v = n.cross(u);
        const Eigen::Vector3d centre = random.point(5);
        const std::uint32_t block = storage.blockAt({0, 0, 0, 0});
        const int k = 3 + random.below(6);
        Eigen::MatrixXd q(k, 3);
        std::vector<VertexId> ids;
        for (int i = 0; i < k; ++i) {
            const Eigen::Vector3d p = centre + random.in(-0.02, 0.02) * u +
                                      random.in(-0.02, 0.02) * v + random.in(-0.002, 0.002) * n;
            ids.push_back(storage.addVertex(block));
            Page& page = storage.page(GraphStorage::pageOf(ids.back()));
            const std::uint32_t slot = GraphStorage::slotOf(ids.back());
            page.x[slot] = static_cast<float>(p.x());
            page.y[slot] = static_cast<float>(p.y());
            page.z[slot] = static_cast<float>(p.z());
            q.row(i) = page.position(slot).cast<double>().transpose();
            if (i > 0) {
                storage.addEdge(ids[0], ids.back(), 100);
            }
        }
        const Eigen::MatrixXd centred = q.rowwise() - q.colwise().mean();  // eq. (11)
        const Eigen::JacobiSVD<Eigen::MatrixXd> svd(centred, Eigen::ComputeFullV);
        if (svd.singularValues()[1] < 3 * (k > 3 ? svd.singularValues()[2] : 0) + 1e-3) {
            continue;  // hardly a plane
        }
        Eigen::Vector3d expected = svd.matrixV().col(2);
        const Eigen::Vector3d camera = centre + random.point(3);
        if (expected.dot(camera - q.row(0).transpose()) < 0) {
            expected = -expected;
        }
        const Eigen::Vector3f fast = planeNormal(storage, ids[0], camera.cast<float>(), true);
        EXPECT_NEAR(fast.norm(), 1.0F, 1e-4F);
        EXPECT_GT(fast.cast<double>().dot(expected), 0.999);
    }
}

TEST(GraphProperty, SavedGraphsComeBackEqual) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const Scene scene = randomScene(random);
        PixelGraph graph(randomOptions(random));
        for (int i = 0; i < 4; ++i) {
            graph.merge(randomView(random, scene));
        }
        std::stringstream first, second;
        graph.save(first);
        PixelGraph back;
        back.load(first);
        back.save(second);
        EXPECT_TRUE(first.str() == second.str());
        const auto edges = [](const PixelGraph& of, VertexId id) {
            std::map<VertexId, float> found;
            of.forEachEdge(id, [&found](VertexId n, float w) { found[n] = w; });
            return found;
        };
        graph.forEachVertex([&](VertexId id) {
            ASSERT_TRUE(back.alive(id));
            EXPECT_EQ(edges(graph, id), edges(back, id));
        });
        const GraphComparison same = compareGraphs(graph, back, 1e-4);
        EXPECT_EQ(same.onlyInA + same.onlyInB, 0U);
        EXPECT_EQ(same.verticesA, same.verticesB);
    }
}

}  // namespace
}  // namespace riftmap
