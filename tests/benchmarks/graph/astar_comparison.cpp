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
        const std::size_t n = points_.size();
        distance_.resize(n);
        cost_.resize(n);
        parent_.resize(n);
        colour_.resize(n);
    }

    /// Writes to all of the map's buffers, as Boost does, but does not allocate them again.
    double length(VertexId source, VertexId goal) {
        const auto index = boost::get(boost::vertex_index, graph_);
        const Eigen::Vector3d end = points_[goal];
        try {
            boost::astar_search(
                graph_, source, [&](std::size_t v) { return (points_[v] - end).norm(); },
                boost::visitor(StopAtGoal(goal))
                    .weight_map(boost::get(&EdgeWeight::weight, graph_))
                    .distance_map(boost::make_iterator_property_map(distance_.begin(), index))
                    .rank_map(boost::make_iterator_property_map(cost_.begin(), index))
                    .predecessor_map(boost::make_iterator_property_map(parent_.begin(), index))
                    .color_map(boost::make_iterator_property_map(colour_.begin(), index)));
        } catch (const Found&) {
            return distance_[goal];
        }
        return std::numeric_limits<double>::infinity();
    }

 private:
    std::vector<Eigen::Vector3d> points_;
    BoostGraph graph_;
    std::vector<double> distance_, cost_;
    std::vector<std::size_t> parent_;
    std::vector<boost::default_color_type> colour_;
};

double ms(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v.empty() ? std::numeric_limits<double>::quiet_NaN() : v[v.size() / 2];
}

}  // namespace

AstarComparison compareAstar(const PixelGraph& graph, std::size_t pairs, std::size_t turns) {
    BoostSearch boost(graph);
    GraphSearch own;
    std::vector<VertexId> ids;
    graph.forEachVertex([&](VertexId id) { ids.push_back(id); });
    std::mt19937 random(7);
    std::vector<std::pair<VertexId, VertexId>> ends;
    AstarComparison result;
    for (std::size_t i = 0; i < pairs; ++i) {  // both warm up on what will be measured
        const VertexId a = ids[random() % ids.size()];
        const VertexId b = ids[random() % ids.size()];
        const auto path = own.shortestPath(graph, a, b);
        const std::size_t expansions = own.expanded();
        const double length = boost.length(a, b);
        if (path && std::isfinite(length)) {
            ends.emplace_back(a, b);
            result.ownExpansions += static_cast<double>(expansions);
            result.largestDifference =
                std::max(result.largestDifference, std::abs(path->length - length) / length);
        } else {
            ++result.unreachable;
            const bool agree = !path && std::isinf(length);
            result.largestDifference = agree ? result.largestDifference : 1.0;
        }
    }
    std::vector<std::vector<double>> ownMs(ends.size()), boostMs(ends.size());
    std::vector<double> ratioOfTurn;
    for (std::size_t turn = 0; turn < turns; ++turn) {
        double ownSum = 0, boostSum = 0;
        for (std::size_t i = 0; i < ends.size(); ++i) {
            const auto [a, b] = ends[i];
            const auto searchOwn = [&] {
                const Clock::time_point start = Clock::now();
                own.shortestPath(graph, a, b);
                ownMs[i].push_back(ms(start));
            };
            const auto searchBoost = [&] {
                const Clock::time_point start = Clock::now();
                boost.length(a, b);
                boostMs[i].push_back(ms(start));
            };
            if (turn % 2 == 0) {
                searchOwn();
                searchBoost();
            } else {
                searchBoost();
                searchOwn();
            }
            ownSum += ownMs[i].back();
            boostSum += boostMs[i].back();
        }
        ratioOfTurn.push_back(boostSum / ownSum);
    }
    std::vector<double> ownOfPair, boostOfPair, ratioOfPair;
    for (std::size_t i = 0; i < ends.size(); ++i) {
        ownOfPair.push_back(median(ownMs[i]));
        boostOfPair.push_back(median(boostMs[i]));
        ratioOfPair.push_back(boostOfPair.back() / ownOfPair.back());
    }
    result.ownExpansions /= static_cast<double>(std::max<std::size_t>(1, ends.size()));
    result.searches = ends.size() * turns;
    result.ownMs = median(ownOfPair);
    result.boostMs = median(boostOfPair);
    result.ratio = median(ratioOfPair);
    const auto [low, high] = std::minmax_element(ratioOfTurn.begin(), ratioOfTurn.end());
    result.lowestTurn = ratioOfTurn.empty() ? result.ratio : *low;
    result.highestTurn = ratioOfTurn.empty() ? result.ratio : *high;
    return result;
}

}  // namespace riftmap
