// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/bucket_queue.h"

namespace riftmap {

/// Has a line of memory on its way while other work goes on. GCC takes functions that do nothing
/// else for without effect and drops their calls; the empty instruction keeps them.
inline void fetchLine(const void* address) {
    __builtin_prefetch(address);
    asm volatile("");
}

/// A PixelGraph as searches read it: its arrays, without a call through its private part for each
/// vertex. Valid while nothing writes to the graph.
class PixelGraphReader {
 public:
    explicit PixelGraphReader(const PixelGraph& graph)
        : storage_(graph.storage()), idLimit_(graph.idLimit()) {}
    VertexId idLimit() const { return idLimit_; }
    Eigen::Vector3f position(VertexId id) const { return storage_.position(id); }
    template <class F>
    void forEachEdge(VertexId id, F&& f) const {
        storage_.forEachHalfEdge(
            id, [&f](VertexId to, std::uint16_t code) { f(to, compact::weightOf(code)); });
    }
    /// Ask for the lines that position(id) and forEachEdge(id, ...) will read.
    void fetchPosition(VertexId id) const {
        const Page& page = storage_.page(GraphStorage::pageOf(id));
        const std::uint32_t slot = GraphStorage::slotOf(id);
        fetchLine(&page.x[slot]);
        fetchLine(&page.y[slot]);
        fetchLine(&page.z[slot]);
    }
    void fetchEdges(VertexId id) const {
        const Page& page = storage_.page(GraphStorage::pageOf(id));
        const std::uint32_t slot = GraphStorage::slotOf(id);
        fetchLine(&page.neighbour[slot]);
        fetchLine(&page.weight[slot]);
        fetchLine(&page.state[slot]);
    }

 private:
    const GraphStorage& storage_;
    VertexId idLimit_;
};

/// A way through the graph.
struct GraphPath {
    std::vector<VertexId> vertices;  ///< source first, goal last
    double length = 0;               ///< sum of its edges' lengths [m]; see GraphSearch
};

/// Shortest paths through large graphs (paper sec. VIII.B): A* with the straight line to the goal
/// as heuristic, and Dijkstra's search for the distances to many vertices.
///
/// `Graph` offers `idLimit()`, `position(id)` (a 3-vector of float [m]) and
/// `forEachEdge(id, f(neighbour, weight [m]))`; a PixelGraph does. The nodes of one search are told
/// from those of earlier ones by a stamp, so a search touches memory only where it goes: buffers
/// are as large as the largest map searched and are never cleared.
///
/// The length of an edge is its weight, but never less than the straight distance of its ends as
/// they lie now: weights are the smallest ever observed, and fusion moves vertices on. With that
/// the straight line to the goal is a consistent heuristic on merged maps too, so no vertex is
/// nearer than the one the search has come to.
///
/// Vertices are expanded by buckets of about equal keys, and once more if an edge shorter than the
/// bucket is wide makes them nearer; the search ends after the bucket of the last target. So the
/// distances are those of a search in strict order, to the last bit. Among ways of equal length
/// the path comes, from each of its vertices, from the one with the smallest id, so that it does
/// not depend on anything but the graph (only edges of length 0 go by the order of expansion,
/// which is fixed). An object serves one thread.
class GraphSearch {
 public:
    /// A* from `source` to `goal`; nothing if there is no way. Both must be alive.
    template <class Graph>
    std::optional<GraphPath> shortestPath(const Graph& graph, VertexId source, VertexId goal) {
        const Point end = pointOf(graph, goal);
        search(readerOf(graph), source, {goal},
               [&end](const Point& p) { return distanceOf(p, end); });
        return met(nodes_[goal]) ? std::optional<GraphPath>(trace(source, goal)) : std::nullopt;
    }

    /// Distance [m] from `source` to each target; infinite where there is no way. Ends when the
    /// last target is reached.
    template <class Graph>
    std::vector<double> distances(const Graph& graph, VertexId source,
                                  const std::vector<VertexId>& targets) {
        search(readerOf(graph), source, targets, [](const Point&) { return 0.0; });
        std::vector<double> result;
        result.reserve(targets.size());
        for (const VertexId id : targets) {
            result.push_back(distanceOf(nodes_[id]));
        }
        return result;
    }

    /// Expansions of the last search: vertices it came to, and again where it had to.
    std::size_t expanded() const { return expanded_; }

 private:
    struct Node {
        double distance;  ///< from the source [m]
        VertexId parent;
        std::uint32_t stamp;  ///< 2 search = to be expanded, 2 search + 1 = done, less = not met
    };
    struct Point {
        double x, y, z;
    };

    template <class Graph>
    static const Graph& readerOf(const Graph& graph) {
        return graph;
    }
    static PixelGraphReader readerOf(const PixelGraph& graph) { return PixelGraphReader(graph); }

    template <class Graph>
    static Point pointOf(const Graph& graph, VertexId id) {
        const Eigen::Vector3f p = graph.position(id);
        return {p.x(), p.y(), p.z()};
    }
    static double distanceOf(const Point& a, const Point& b) {
        const double x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
        return std::sqrt(x * x + y * y + z * z);
    }

    std::uint32_t openStamp() const { return 2 * search_; }
    std::uint32_t closedStamp() const { return 2 * search_ + 1; }
    bool met(const Node& node) const { return node.stamp >= openStamp(); }
    double distanceOf(const Node& node) const {
        return met(node) ? node.distance : std::numeric_limits<double>::infinity();
    }

    void begin(VertexId idLimit, VertexId source) {
        if (source >= idLimit) {
            throw std::invalid_argument("path search from vertex " + std::to_string(source) +
                                        ", but the graph has ids below " + std::to_string(idLimit));
        }
        if (nodes_.size() < idLimit) {
            nodes_.resize(idLimit, Node{0.0, kNoVertex, 0});
        }
        if (++search_ == kLastSearch) {  // stamps are used up: forget all of them once
            std::fill(nodes_.begin(), nodes_.end(), Node{0.0, kNoVertex, 0});
            search_ = 1;
        }
        queue_.clear();
        expanded_ = 0;
        nodes_[source] = {0.0, kNoVertex, openStamp()};
    }

    /// Until the distances of all targets are known, or nothing is left. `heuristic` of a target
    /// is 0.
    template <class Graph, class Heuristic>
    void search(const Graph& graph, VertexId source, std::vector<VertexId> targets,
                const Heuristic& heuristic) {
        begin(graph.idLimit(), source);
        queue_.push(heuristic(pointOf(graph, source)), source);
        while (queue_.advance() && !reached(targets)) {
            expandBucket(graph, heuristic);
        }
    }

    /// Takes targets away whose distance no key to come can shorten. Keys on the way to a target
    /// exceed its distance by rounding at most.
    bool reached(std::vector<VertexId>& targets) const {
        constexpr double kRounding = 1 + 1e-9;
        while (!targets.empty() &&
               distanceOf(nodes_[targets.back()]) * kRounding < queue_.floor()) {
            targets.pop_back();
        }
        return targets.empty();
    }

    template <class Graph, class Heuristic>
    void expandBucket(const Graph& graph, const Heuristic& heuristic) {
        const std::vector<VertexId>& bucket = queue_.bucket();
        for (std::size_t i = 0; i < bucket.size(); ++i) {
            fetchAhead(graph, bucket, i);
            Node& node = nodes_[bucket[i]];
            if (node.stamp == openStamp()) {  // else expanded since, by a smaller key
                node.stamp = closedStamp();
                ++expanded_;
                relaxEdges(graph, bucket[i], heuristic);
            }
        }
    }

    template <class Graph, class Heuristic>
    void relaxEdges(const Graph& graph, VertexId id, const Heuristic& heuristic) {
        const double base = nodes_[id].distance;
        const Point here = pointOf(graph, id);
        graph.forEachEdge(id, [&](VertexId to, float weight) {
            Node& node = nodes_[to];
            const double least = base + static_cast<double>(weight);
            if (met(node) && !(least <= node.distance)) {
                return;
            }
            const Point there = pointOf(graph, to);
            const double distance = std::max(least, base + distanceOf(here, there));
            if (!met(node) || distance < node.distance) {
                node = {distance, id, openStamp()};
                queue_.push(distance + heuristic(there), to);
            } else if (distance == node.distance && base < distance && id < node.parent) {
                node.parent = id;
            }
        });
    }

    /// What the bucket's next vertices need is on its way from memory while this one is worked on:
    /// first their own data, then, when that tells who they are, their neighbours'.
    template <class Graph>
    void fetchAhead(const Graph& graph, const std::vector<VertexId>& bucket, std::size_t i) const {
        if constexpr (requires { graph.fetchEdges(VertexId{}); }) {
            if (i + kFetchVertex < bucket.size()) {
                const VertexId id = bucket[i + kFetchVertex];
                fetchLine(&nodes_[id]);
                graph.fetchEdges(id);
                graph.fetchPosition(id);
            }
            if (i + kFetchNeighbours < bucket.size()) {
                graph.forEachEdge(bucket[i + kFetchNeighbours], [&](VertexId to, float /*weight*/) {
                    fetchLine(&nodes_[to]);
                    graph.fetchPosition(to);
                });
            }
        }
    }

    GraphPath trace(VertexId source, VertexId goal) const {
        GraphPath path;
        path.length = nodes_[goal].distance;
        for (VertexId id = goal; id != source; id = nodes_[id].parent) {
            path.vertices.push_back(id);
        }
        path.vertices.push_back(source);
        std::reverse(path.vertices.begin(), path.vertices.end());
        return path;
    }

    static constexpr std::uint32_t kLastSearch = 0x7FFFFFFFU;
    static constexpr std::size_t kFetchVertex = 16, kFetchNeighbours = 8;  ///< expansions ahead

    std::vector<Node> nodes_;  ///< by vertex id
    BucketQueue queue_;
    std::uint32_t search_ = 0;
    std::size_t expanded_ = 0;
};

}  // namespace riftmap
