// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/map_surface.h"

#include <algorithm>

namespace riftmap {

namespace {

/// The diagonal of a square of pixels is 1.41 of its side.
constexpr float kWidest = 1.5F;

}  // namespace

MapSurface surfaceOf(const PixelGraph& graph) {
    MapSurface out;
    std::vector<std::uint32_t> indexOf(graph.idLimit());
    graph.forEachVertex([&](VertexId id) {
        indexOf[id] = static_cast<std::uint32_t>(out.vertices.size());
        const Vertex v = graph.vertex(id);
        out.vertices.push_back(v.position);
        out.deviations.push_back(v.sigma * v.normal);
    });
    std::vector<std::pair<std::uint32_t, float>> around;  // neighbour, squared length
    graph.forEachVertex([&](VertexId id) {
        const std::uint32_t v = indexOf[id];
        around.clear();
        graph.forEachEdge(id, [&](VertexId n, float /*weight*/, bool high) {
            if (!high) {
                around.emplace_back(indexOf[n],
                                    (out.vertices[indexOf[n]] - out.vertices[v]).squaredNorm());
            }
        });
        for (std::size_t i = 0; i < around.size(); ++i) {
            const auto& [a, lengthA] = around[i];
            if (a > v) {
                out.triangles.push_back({v, a, a});
            }
            for (std::size_t k = i + 1; k < around.size(); ++k) {
                const auto& [b, lengthB] = around[k];
                const float across = (out.vertices[a] - out.vertices[b]).squaredNorm();
                if (across <= kWidest * kWidest * std::max(lengthA, lengthB)) {
                    out.triangles.push_back({v, a, b});
                }
            }
        }
    });
    return out;
}

std::vector<Eigen::Vector3f> rimsOf(const PixelGraph& graph) {
    std::vector<Eigen::Vector3f> rims;
    for (const Rift& rift : graph.rifts()) {
        for (const VertexId id : rift.vertices) {
            rims.push_back(graph.position(id));
        }
    }
    return rims;
}

}  // namespace riftmap
