// SPDX-License-Identifier: BSD-3-Clause
#include "astar_comparison.h"

#include <algorithm>
#include <boost/graph/astar_search.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "riftmap/planner/astar.h"

namespace riftmap {
namespace {

using Clock = std::chrono::steady_clock;

struct EdgeWeight {
    double weight;
};
using BoostGraph =
    boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, EdgeWeight>;

struct Found : std::exception {};

struct StopAtGoal : boost::default_astar_visitor {
    VertexId goal;
    explicit StopAtGoal(VertexId g) : goal(g) {}
    template <class Graph>
    void examine_vertex(VertexId v, const Graph& /*graph*/) const {
        if (v == goal) {
            throw Found();
        }
    }
};

class BoostSearch {
 public:
    explicit BoostSearch(const PixelGraph& graph) {
        std::vector<std::pair<VertexId, VertexId>> ends;
        std::vector<EdgeWeight> weights;
        points_.resize(graph.idLimit());
        graph.forEachVertex([&](VertexId id) { points_[id] = graph.position(id).cast<double>(); });
        graph.forEachVertex([&](VertexId id) {
            graph.forEachEdge(id, [&](VertexId to, float w) {
                ends.emplace_back(id, to);
                weights.push_back(
                    {std::max(static_cast<double>(w), (points_[id] - points_[to]).norm())});
            });
        });
        graph_ = BoostGraph(boost::edges_are_unsorted_multi_pass, ends.begin(), ends.end(),
                            weights.begin(), graph.idLimit());
    }

    double length(VertexId source, VertexId goal) {
        const std::size_t n = points_.size();
        std::vector<double> distance(n), cost(n);
        std::vector<std::size_t> parent(n);
        std::vector<boost::default_color_type> colour(n);
        const auto index = boost::get(boost::vertex_index, graph_);
        const Eigen::Vector3d end = points_[goal];
        try {
            boost::astar_search(
                graph_, source, [&](std::size_t v) { return (points_[v] - end).norm(); },
                boost::visitor(StopAtGoal(goal))
                    .weight_map(boost::get(&EdgeWeight::weight, graph_))
                    .distance_map(boost::make_iterator_property_map(distance.begin(), index))
                    .rank_map(boost::make_iterator_property_map(cost.begin(), index))
                    .predecessor_map(boost::make_iterator_property_map(parent.begin(), index))
                    .color_map(boost::make_iterator_property_map(colour.begin(), index)));
        } catch (const Found&) {
            return distance[goal];
        }
        return std::numeric_limits<double>::infinity();
    }

 private:
    std::vector<Eigen::Vector3d> points_;
    BoostGraph graph_;
};

double ms(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v.empty() ? std::numeric_limits<double>::quiet_NaN() : v[v.size() / 2];
}

}  // namespace

AstarComparison compareAstar(const PixelGraph& graph, std::size_t searches) {
    BoostSearch boost(graph);
    GraphSearch own;
    std::vector<VertexId> ids;
    graph.forEachVertex([&](VertexId id) { ids.push_back(id); });
    std::mt19937 random(7);
    AstarComparison result;
    std::vector<double> ownMs, boostMs, ratio;
    for (std::size_t i = 0; i <= searches; ++i) {
        const VertexId a = ids[random() % ids.size()];
        const VertexId b = ids[random() % ids.size()];
        Clock::time_point start = Clock::now();
        const auto path = own.shortestPath(graph, a, b);
        const double ownTime = ms(start);
        start = Clock::now();
        const double length = boost.length(a, b);
        const double boostTime = ms(start);
        if (!path || std::isinf(length)) {
            result.unreachable += 1;
            const bool agree = !path && std::isinf(length);
            result.largestDifference = agree ? result.largestDifference : 1.0;
            continue;
        }
        result.largestDifference =
            std::max(result.largestDifference, std::abs(path->length - length) / length);
        if (i > 0) {  // the first search grows the buffers
            ownMs.push_back(ownTime);
            boostMs.push_back(boostTime);
            ratio.push_back(boostTime / ownTime);
        }
    }
    result.searches = ratio.size();
    result.ownMs = median(ownMs);
    result.boostMs = median(boostMs);
    result.ratio = median(ratio);
    return result;
}

}  // namespace riftmap
