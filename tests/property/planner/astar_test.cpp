// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/astar.h"

#include <gtest/gtest.h>

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/dijkstra_shortest_paths.hpp>
#include <cmath>
#include <limits>
#include <queue>
#include <random>
#include <tuple>

namespace riftmap {
namespace {

/// A plain graph with the three functions that the search asks for.
struct TestGraph {
    struct Edge {
        VertexId to;
        float weight;
    };
    std::vector<Eigen::Vector3f> points;
    std::vector<std::vector<Edge>> edges;

    VertexId idLimit() const { return static_cast<VertexId>(points.size()); }
    Eigen::Vector3f position(VertexId id) const { return points[id]; }
    template <class F>
    void forEachEdge(VertexId id, const F& f) const {
        for (const Edge& e : edges[id]) {
            f(e.to, e.weight);
        }
    }
    void connect(VertexId a, VertexId b, float factor) {
        const float w = (points[a] - points[b]).norm() * factor;
        edges[a].push_back({b, w});
        edges[b].push_back({a, w});
    }
};

/// Of an edge: its weight, but at least the straight distance.
double lengthOf(const TestGraph& g, VertexId from, const TestGraph::Edge& e) {
    const Eigen::Vector3d a = g.points[from].cast<double>(), b = g.points[e.to].cast<double>();
    return std::max(static_cast<double>(e.weight), (a - b).norm());
}

/// Random points joined to some near ones, with detours and with weights below the straight
/// distance, as merging leaves them; falls into several parts.
TestGraph randomGraph(std::mt19937& random, std::size_t n) {
    TestGraph g;
    std::uniform_real_distribution<float> coordinate(0, 1);
    for (std::size_t i = 0; i < n; ++i) {
        g.points.emplace_back(coordinate(random), coordinate(random), 0.2F * coordinate(random));
    }
    g.edges.resize(n);
    const float reach = 1.5F / std::sqrt(static_cast<float>(n));
    for (VertexId a = 0; a < n; ++a) {
        for (VertexId b = a + 1; b < n; ++b) {
            if ((g.points[a] - g.points[b]).norm() < reach && coordinate(random) < 0.7F) {
                g.connect(a, b, 0.2F + 1.8F * coordinate(random));
            }
        }
    }
    return g;
}

std::vector<double> boostDistances(const TestGraph& g, VertexId source) {
    using Boost =
        boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS, boost::no_property,
                              boost::property<boost::edge_weight_t, double>>;
    Boost graph(g.points.size());
    for (VertexId a = 0; a < g.idLimit(); ++a) {
        for (const auto& e : g.edges[a]) {
            boost::add_edge(a, e.to, lengthOf(g, a, e), graph);
        }
    }
    std::vector<double> distance(g.points.size());
    boost::dijkstra_shortest_paths(graph, source,
                                   boost::distance_map(boost::make_iterator_property_map(
                                       distance.begin(), boost::get(boost::vertex_index, graph))));
    return distance;
}

double lengthOf(const TestGraph& g, const std::vector<VertexId>& path) {
    double sum = 0;
    for (std::size_t i = 1; i < path.size(); ++i) {
        double best = std::numeric_limits<double>::infinity();
        for (const auto& e : g.edges[path[i - 1]]) {
            best = e.to == path[i] ? std::min(best, lengthOf(g, path[i - 1], e)) : best;
        }
        sum += best;
    }
    return sum;
}

TEST(GraphSearch, isAsShortAsBoostOnRandomGraphs) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    GraphSearch search;  // one for all: stamps must keep the searches apart
    int found = 0;
    int parted = 0;
    for (int round = 0; round < 30; ++round) {
        const TestGraph g = randomGraph(random, 50 + 10 * static_cast<std::size_t>(round));
        std::uniform_int_distribution<VertexId> any(0, g.idLimit() - 1);
        const VertexId source = any(random);
        const std::vector<double> reference = boostDistances(g, source);
        for (int i = 0; i < 10; ++i) {
            const VertexId goal = any(random);
            const auto path = search.shortestPath(g, source, goal);
            if (reference[goal] == std::numeric_limits<double>::max()) {
                EXPECT_FALSE(path);
                ++parted;
                continue;
            }
            ASSERT_TRUE(path);
            ++found;
            EXPECT_EQ(path->vertices.front(), source);
            EXPECT_EQ(path->vertices.back(), goal);
            EXPECT_NEAR(path->length, reference[goal], 1e-9);
            EXPECT_NEAR(lengthOf(g, path->vertices), path->length, 1e-9);
        }
    }
    EXPECT_GT(found, 20);
    EXPECT_GT(parted, 0);
}

TEST(GraphSearch, distancesEqualBoostToAllTargets) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    GraphSearch search;
    for (int round = 0; round < 10; ++round) {
        const TestGraph g = randomGraph(random, 300);
        const std::vector<double> reference = boostDistances(g, 0);
        std::vector<VertexId> targets;
        for (VertexId id = 0; id < g.idLimit(); id += 7) {
            targets.push_back(id);
        }
        targets.push_back(targets.front());  // twice the same is no trouble
        const std::vector<double> distance = search.distances(g, 0, targets);
        for (std::size_t i = 0; i < targets.size(); ++i) {
            const double expected = reference[targets[i]];
            if (expected == std::numeric_limits<double>::max()) {
                EXPECT_TRUE(std::isinf(distance[i]));
            } else {
                EXPECT_NEAR(distance[i], expected, 1e-9);
            }
        }
    }
}

/// A lattice whose points lie `spacing` apart, but for `shift` of them on the one before, so that
/// edges of length 0 arise; joined to the right and upwards by weights from `weight`.
template <class Weight>
TestGraph lattice(VertexId side, float spacing, double shift, std::mt19937& random,
                  const Weight& weight) {
    TestGraph g;
    std::bernoulli_distribution moves(shift);
    for (VertexId i = 0; i < side * side; ++i) {
        const float x = spacing * static_cast<float>(i % side);
        const float y = spacing * static_cast<float>(i / side);
        g.points.emplace_back(x, y, 0.0F);
        if (i % side > 0 && moves(random)) {
            g.points.back() = g.points[i - 1];
        }
    }
    g.edges.resize(g.points.size());
    for (VertexId i = 0; i < side * side; ++i) {
        const auto join = [&](VertexId to) {
            const float w = weight();
            g.edges[i].push_back({to, w});
            g.edges[to].push_back({i, w});
        };
        if (i % side + 1 < side) {
            join(i + 1);
        }
        if (i + side < side * side) {
            join(i + side);
        }
    }
    return g;
}

/// The slow reference: strictly by the smallest distance, no heuristic, to the end. Its lengths
/// are the sums that the search has to give, to the last bit.
struct StrictSearch {
    std::vector<double> distance;

    StrictSearch(const TestGraph& g, VertexId source)
        : distance(g.points.size(), std::numeric_limits<double>::infinity()) {
        using Entry = std::pair<double, VertexId>;
        std::priority_queue<Entry, std::vector<Entry>, std::greater<>> heap;
        distance[source] = 0;
        heap.push({0, source});
        while (!heap.empty()) {
            const auto [key, id] = heap.top();
            heap.pop();
            if (key > distance[id]) {
                continue;
            }
            for (const auto& e : g.edges[id]) {
                if (const double d = key + stepOf(g, id, e); d < distance[e.to]) {
                    distance[e.to] = d;
                    heap.push({d, e.to});
                }
            }
        }
    }

    static double stepOf(const TestGraph& g, VertexId from, const TestGraph::Edge& e) {
        const Eigen::Vector3f& p = g.points[from];
        const Eigen::Vector3f& q = g.points[e.to];
        const double x = double{p.x()} - q.x(), y = double{p.y()} - q.y(),
                     z = double{p.z()} - q.z();
        return std::max(static_cast<double>(e.weight), std::sqrt(x * x + y * y + z * z));
    }

    /// Of the vertices by which `id` is reached soonest, and that are nearer, the smallest.
    VertexId before(const TestGraph& g, VertexId id) const {
        VertexId least = kNoVertex;
        for (const auto& e : g.edges[id]) {
            const double d = distance[e.to] + stepOf(g, e.to, {id, e.weight});
            if (d == distance[id] && distance[e.to] < distance[id]) {
                least = std::min(least, e.to);
            }
        }
        return least;
    }
};

TEST(GraphSearch, equalsTheStrictSearchToTheLastBitWhateverTheWeights) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0, 1);
    const auto equal = [] { return 1.0F; };           // nothing but ties
    const auto below = [&] { return unit(random); };  // below the straight distance
    const auto longer = [&] { return 1.0F + 3.0F * unit(random); };
    const auto torn = [&] {  // a few edges as across a tear, among tiny ones and zeros
        const float u = unit(random);
        return u < 0.02F ? 1e4F * u : u < 0.2F ? 0.0F : 1e-3F * u;
    };
    const auto scales = [&] { return std::pow(10.0F, 8.0F * unit(random) - 6.0F); };
    GraphSearch search;
    int zeroEdges = 0, compared = 0;
    for (int round = 0; round < 20; ++round) {
        const VertexId side = 10 + 3 * static_cast<VertexId>(round);
        const double shift = round % 2 == 0 ? 0.0 : 0.2;
        for (const TestGraph& g :
             {lattice(side, 1.0F, shift, random, equal), lattice(side, 1.0F, shift, random, below),
              lattice(side, 1.0F, shift, random, longer), lattice(side, 1e-3F, shift, random, torn),
              lattice(side, 0.0F, 0.0, random, torn), lattice(side, 1e-4F, shift, random, scales),
              randomGraph(random, side * side)}) {
            std::uniform_int_distribution<VertexId> any(0, g.idLimit() - 1);
            const VertexId source = any(random);
            const StrictSearch reference(g, source);
            std::vector<VertexId> targets;
            for (int i = 0; i < 5; ++i) {
                const VertexId goal = targets.emplace_back(any(random));
                const auto path = search.shortestPath(g, source, goal);
                ASSERT_EQ(path.has_value(), std::isfinite(reference.distance[goal]));
                if (!path) {
                    continue;
                }
                ++compared;
                ASSERT_EQ(path->length, reference.distance[goal]);
                ASSERT_EQ(path->vertices.front(), source);
                for (std::size_t k = 1; k < path->vertices.size(); ++k) {
                    const VertexId from = path->vertices[k - 1], to = path->vertices[k];
                    if (reference.distance[from] == reference.distance[to]) {
                        ++zeroEdges;  // there the order of expansion decides
                    } else {
                        ASSERT_EQ(from, reference.before(g, to));
                    }
                }
            }
            const std::vector<double> distance = search.distances(g, source, targets);
            for (std::size_t i = 0; i < targets.size(); ++i) {
                ASSERT_EQ(distance[i], reference.distance[targets[i]]);
            }
        }
    }
    EXPECT_GT(compared, 500);
    EXPECT_GT(zeroEdges, 100);
}

TEST(BucketQueue, givesAllKeysAndNoSmallerOneAfterABucket) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    BucketQueue queue;  // one for all
    for (int round = 0; round < 60; ++round) {
        queue.clear();
        std::vector<double> keys;  // by id
        const double farAway = std::pow(10.0, 12 * unit(random) - 2);
        const auto push = [&](double base) {
            const double u = unit(random);
            keys.push_back(u < 0.3    ? base  // equal keys
                           : u < 0.31 ? base + farAway
                                      : base + unit(random));
            queue.push(keys.back(), static_cast<VertexId>(keys.size() - 1));
        };
        const double start = round % 3 == 0 ? 0.0 : 100 * unit(random);
        for (int i = 0; i < 1 + 300 * (round % 4); ++i) {
            push(start);
        }
        std::size_t taken = 0, buckets = 0;
        double largest = 0;  // of the buckets left
        while (queue.advance()) {
            ++buckets;
            double here = largest;
            ASSERT_FALSE(queue.bucket().empty());
            ASSERT_GE(queue.floor() * (1 + 1e-12), largest);
            for (std::size_t i = 0; i < queue.bucket().size(); ++i) {
                const double key = keys[queue.bucket()[i]];
                ASSERT_GE(key * (1 + 1e-12), queue.floor());
                here = std::max(here, key);
                ++taken;
                if (keys.size() < 20000) {
                    push(key);
                }
            }
            largest = here;
        }
        EXPECT_EQ(taken, keys.size());
        EXPECT_GT(buckets, 20U);  // one for all were no order at all
    }
}

TEST(GraphSearch, looksOnlyTowardsTheGoal) {
    TestGraph g;
    const VertexId side = 100;
    for (VertexId i = 0; i < side * side; ++i) {
        g.points.emplace_back(static_cast<float>(i % side), static_cast<float>(i / side), 0.0F);
    }
    g.edges.resize(g.points.size());
    for (VertexId i = 0; i < side * side; ++i) {
        if (i % side + 1 < side) {
            g.connect(i, i + 1, 1.0F);
        }
        if (i + side < side * side) {
            g.connect(i, i + side, 1.0F);
        }
    }
    GraphSearch search;
    const VertexId row = 50 * side;
    const auto path = search.shortestPath(g, row + 20, row + 80);
    ASSERT_TRUE(path);
    EXPECT_EQ(path->vertices.size(), 61U);
    EXPECT_LT(search.expanded(), 200U);  // Dijkstra's circle would hold about 7,000
}

TEST(GraphSearch, expandsEachVertexOnceAlsoWhereWeightsAreBelowTheStraightDistance) {
    // As merging leaves them. Searches that take vertices up again did not end on real maps.
    std::mt19937 random(7);
    std::uniform_real_distribution<float> factor(0.01F, 1.0F);
    constexpr VertexId kSide = 60;
    TestGraph g;
    for (VertexId i = 0; i < kSide * kSide; ++i) {
        g.points.emplace_back(static_cast<float>(i % kSide), static_cast<float>(i / kSide), 0.0F);
    }
    g.edges.resize(g.points.size());
    for (VertexId i = 0; i < g.idLimit(); ++i) {
        if (i % kSide + 1 < kSide) {
            g.connect(i, i + 1, factor(random));
        }
        if (i + kSide < g.idLimit()) {
            g.connect(i, i + kSide, factor(random));
        }
    }
    GraphSearch search;
    const auto path = search.shortestPath(g, 0, g.idLimit() - 1);
    ASSERT_TRUE(path);
    EXPECT_LE(search.expanded(), g.points.size());
    EXPECT_NEAR(lengthOf(g, path->vertices), path->length, 1e-9);
}

TEST(GraphSearch, fromItselfIsAVertexLong) {
    TestGraph g;
    g.points.emplace_back(0.0F, 0.0F, 0.0F);
    g.edges.resize(1);
    const auto path = GraphSearch().shortestPath(g, 0, 0);
    ASSERT_TRUE(path);
    EXPECT_EQ(path->vertices, std::vector<VertexId>{0});
    EXPECT_EQ(path->length, 0.0);
    EXPECT_THROW(GraphSearch().shortestPath(g, 1, 0), std::invalid_argument);
}

}  // namespace
}  // namespace riftmap
