// SPDX-License-Identifier: BSD-3-Clause
// Which edges of a view concern the map, in vector code. The same lists on every machine.
#pragma once

#include <cstddef>
#include <cstdint>

#include "riftmap/graph/graph_storage.h"

namespace riftmap {

/// Edges from the pixels [0, count) to those beside and below them, one and `width` behind in
/// memory. All arrays are readable to count + width + kEdgePadding.
struct EdgeSpan {
    const VertexId* vertex = nullptr;     ///< of a pixel
    const std::uint8_t* fresh = nullptr;  ///< 1 = the vertex is new
    /// Weight codes, ViewPoints::kNoEdge = none.
    const std::uint16_t *right = nullptr, *down = nullptr;
    std::size_t count = 0, width = 0;
};
inline constexpr std::size_t kEdgePadding = 64;

/// Vertices with the ends and codes of their edges; kNoVertex where there is nothing to compare.
/// All with room for count + kEdgePadding.
struct EdgeList {
    VertexId *from = nullptr, *right = nullptr, *down = nullptr;
    std::uint32_t* codes = nullptr;  ///< right | down << 16
};

/// Lists the pixels with an edge to another vertex where not both are new; returns how many.
std::size_t listEdges(const EdgeSpan& span, const EdgeList& list);

}  // namespace riftmap
