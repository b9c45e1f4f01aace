// SPDX-License-Identifier: BSD-3-Clause
// A* over a pixel graph of a million vertices, by turns with Boost.Graph's A* over the same
// vertices and edges in a compressed-row graph. Both use the straight line as heuristic.
//
//   bench-astar [--csv FILE]
#include <algorithm>
#include <boost/graph/astar_search.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>

#include "riftmap/core/csv.h"
#include "riftmap/planner/astar.h"

namespace {

using riftmap::PixelGraph;
using riftmap::VertexId;
using Clock = std::chrono::steady_clock;

struct EdgeWeight {
    double weight;
};
using BoostGraph =
    boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, EdgeWeight>;

/// Rolling ground, 2 m and more below the camera.
double height(double x, double y) {
    return 0.25 * std::sin(1.7 * x) * std::cos(1.3 * y);
}

riftmap::View viewFrom(double x, double y) {
    riftmap::View view;
    auto& c = view.camera;
    c.width = 512;
    c.height = 384;
    c.fx = c.fy = 420;
    c.cx = 255.5;
    c.cy = 191.5;
    c.baseline = 0.12;
    view.world_T_camera = riftmap::lookAt({x, y, 2.0}, {x, y, 0.0});
    view.disparity.resize(c.width, c.height);
    view.image = cv::Mat(c.height, c.width, CV_8UC1, cv::Scalar(128));
    const riftmap::Pose& pose = view.world_T_camera;
    for (int row = 0; row < c.height; ++row) {
        for (int column = 0; column < c.width; ++column) {
            const Eigen::Vector3d ray =
                pose.rotation * Eigen::Vector3d((column - c.cx) / c.fx, (row - c.cy) / c.fy, 1.0);
            double z = 2.0;
            for (int i = 0; i < 20; ++i) {  // the slope is small: converges
                z = (pose.translation.z() - height(x + z * ray.x(), y + z * ray.y())) / -ray.z();
            }
            const std::size_t i = view.disparity.index(column, row);
            view.disparity.disparity[i] = static_cast<float>(c.disparity(z));
            view.disparity.sigma[i] = 0.05F;
        }
    }
    return view;
}

PixelGraph makeMap(std::size_t vertices) {
    riftmap::GraphOptions options;
    options.gamma = 0.002;  // finer than the pixels: overlapping views keep their vertices
    PixelGraph graph(options);
    for (int i = 0; graph.vertexCount() < vertices; ++i) {
        graph.merge(viewFrom(2.0 * (i % 3), 1.5 * (i / 3)));
    }
    return graph;
}

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
        graph.forEachVertex([&](VertexId id) {
            points_[id] = graph.position(id);
            graph.forEachEdge(id, [&](VertexId to, float w) {
                ends.emplace_back(id, to);
                weights.push_back({static_cast<double>(w)});
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
        const Eigen::Vector3d end = points_[goal].cast<double>();
        try {
            boost::astar_search(
                graph_, source,
                [&](std::size_t v) { return (points_[v].cast<double>() - end).norm(); },
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
    std::vector<Eigen::Vector3f> points_;
    BoostGraph graph_;
};

double ms(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
    const PixelGraph graph = makeMap(1000000);
    BoostSearch boost(graph);
    riftmap::GraphSearch ours;
    std::vector<VertexId> ids;
    graph.forEachVertex([&](VertexId id) { ids.push_back(id); });
    std::mt19937 random(7);
    std::vector<double> oursMs, boostMs, ratio;
    double worst = 0;
    for (int i = 0; i < 21; ++i) {
        const VertexId a = ids[random() % ids.size()];
        const VertexId b = ids[random() % ids.size()];
        auto t = Clock::now();
        const auto path = ours.shortestPath(graph, a, b);
        const double ownTime = ms(t);
        t = Clock::now();
        const double length = boost.length(a, b);
        const double boostTime = ms(t);
        if (!path || std::abs(path->length - length) > 1e-6 * length) {
            std::fprintf(stderr, "bench-astar: lengths differ from %u to %u: %.9g and %.9g\n", a, b,
                         path ? path->length : -1.0, length);
            return EXIT_FAILURE;
        }
        worst = std::max(worst, std::abs(path->length - length));
        if (i > 0) {  // the first search grows the buffers
            oursMs.push_back(ownTime);
            boostMs.push_back(boostTime);
            ratio.push_back(boostTime / ownTime);
        }
    }
    std::printf(
        "%zu vertices, %zu edges, 20 searches: own %.1f ms, Boost.Graph %.1f ms, ratio "
        "%.2f (medians); largest difference of lengths %.2g m\n",
        graph.vertexCount(), graph.edgeCount(), median(oursMs), median(boostMs), median(ratio),
        worst);
    for (int i = 1; i + 1 < argc; ++i) {
        if (std::strcmp(argv[i], "--csv") == 0) {
            riftmap::CsvWriter csv(argv[i + 1], {"name", "value", "unit"});
            csv.row({"astar_ms_median", median(oursMs), "ms"});
            csv.row({"astar_boost_ms_median", median(boostMs), "ms"});
            csv.row({"astar_time_ratio_boost", median(ratio), ""});
        }
    }
    return EXIT_SUCCESS;
}
