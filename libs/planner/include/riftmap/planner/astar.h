// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "riftmap/graph/pixel_graph.h"

namespace riftmap {

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
/// the straight line to the goal is a consistent heuristic on merged maps too, so the path is the
/// shortest one and each vertex is expanded once. Equal lengths are broken by the smaller id, so
/// the result does not depend on anything but the graph. An object serves one thread.
class GraphSearch {
 public:
    /// A* from `source` to `goal`; nothing if there is no way. Both must be alive.
    template <class Graph>
    std::optional<GraphPath> shortestPath(const Graph& graph, VertexId source, VertexId goal) {
        const Eigen::Vector3d end = graph.position(goal).template cast<double>();
        const auto straight = [&end](const Eigen::Vector3d& p) { return (p - end).norm(); };
        begin(graph.idLimit(), source, straight(graph.position(source).template cast<double>()));
        while (!heap_.empty()) {
            const VertexId id = pop();
            if (id == goal) {
                return trace(source, goal);
            }
            if (id != kNoVertex) {
                relaxEdges(graph, id, straight);
            }
        }
        return std::nullopt;
    }

    /// Distance [m] from `source` to each target; infinite where there is no way. Ends when the
    /// last target is reached.
    template <class Graph>
    std::vector<double> distances(const Graph& graph, VertexId source,
                                  const std::vector<VertexId>& targets) {
        begin(graph.idLimit(), source, 0.0);
        const auto none = [](const Eigen::Vector3d&) { return 0.0; };
        std::vector<VertexId> left = targets;
        std::sort(left.begin(), left.end());
        left.erase(std::unique(left.begin(), left.end()), left.end());
        std::size_t missing = left.size();
        while (!heap_.empty() && missing > 0) {
            const VertexId id = pop();
            if (id == kNoVertex) {
                continue;
            }
            missing -= std::binary_search(left.begin(), left.end(), id) ? 1 : 0;
            relaxEdges(graph, id, none);
        }
        std::vector<double> result;
        result.reserve(targets.size());
        for (const VertexId id : targets) {
            result.push_back(nodes_[id].stamp == closedStamp()
                                 ? nodes_[id].distance
                                 : std::numeric_limits<double>::infinity());
        }
        return result;
    }

    /// Vertices taken off the heap for good by the last search.
    std::size_t expanded() const { return expanded_; }

 private:
    struct Node {
        double distance;  ///< from the source [m]
        VertexId parent;
        std::uint32_t stamp;  ///< 2 search = open, 2 search + 1 = closed, else not met yet
    };
    struct Entry {
        double key;  ///< distance + heuristic [m]
        VertexId id;
        bool operator<(const Entry& b) const { return key < b.key || (key == b.key && id < b.id); }
    };

    std::uint32_t openStamp() const { return 2 * search_; }
    std::uint32_t closedStamp() const { return 2 * search_ + 1; }

    void begin(VertexId idLimit, VertexId source, double key) {
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
        heap_.clear();
        expanded_ = 0;
        nodes_[source] = {0.0, kNoVertex, openStamp()};
        push({key, source});
    }

    /// The open vertex with the smallest key, now closed; kNoVertex if the entry was outdated.
    VertexId pop() {
        const VertexId id = heap_.front().id;
        const Entry last = heap_.back();
        heap_.pop_back();
        if (!heap_.empty()) {
            siftDown(last);
        }
        Node& node = nodes_[id];
        if (node.stamp == closedStamp()) {
            return kNoVertex;
        }
        node.stamp = closedStamp();
        ++expanded_;
        return id;
    }

    template <class Graph, class Heuristic>
    void relaxEdges(const Graph& graph, VertexId id, const Heuristic& heuristic) {
        const double base = nodes_[id].distance;
        const Eigen::Vector3d here = graph.position(id).template cast<double>();
        graph.forEachEdge(id, [&](VertexId to, float weight) {
            Node& node = nodes_[to];
            const double least = base + static_cast<double>(weight);
            if (node.stamp == closedStamp() ||
                (node.stamp == openStamp() && !(least < node.distance))) {
                return;
            }
            const Eigen::Vector3d there = graph.position(to).template cast<double>();
            const double distance = std::max(least, base + (there - here).norm());
            if (node.stamp != openStamp() || distance < node.distance) {
                node = {distance, id, openStamp()};
                push({distance + heuristic(there), to});
            }
        });
    }

    // A heap of four children a node: half the levels of a binary one, and the children share a
    // cache line or two.
    void push(const Entry& entry) {
        std::size_t i = heap_.size();
        heap_.push_back(entry);
        while (i > 0) {
            const std::size_t parent = (i - 1) / 4;
            if (!(entry < heap_[parent])) {
                break;
            }
            heap_[i] = heap_[parent];
            i = parent;
        }
        heap_[i] = entry;
    }
    void siftDown(const Entry& entry) {
        const std::size_t n = heap_.size();
        std::size_t i = 0;
        for (;;) {
            const std::size_t first = 4 * i + 1;
            if (first >= n) {
                break;
            }
            std::size_t least = first;
            for (std::size_t c = first + 1; c < std::min(first + 4, n); ++c) {
                least = heap_[c] < heap_[least] ? c : least;
            }
            if (!(heap_[least] < entry)) {
                break;
            }
            heap_[i] = heap_[least];
            i = least;
        }
        heap_[i] = entry;
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

    std::vector<Node> nodes_;  ///< by vertex id
    std::vector<Entry> heap_;
    std::uint32_t search_ = 0;
    std::size_t expanded_ = 0;
};

}  // namespace riftmap
