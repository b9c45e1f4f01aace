// SPDX-License-Identifier: BSD-3-Clause
// Which edges of a view concern the map, in vector code. The same lists on every machine.
#pragma once

#include <cstddef>
#include <cstdint>

#include "riftmap/graph/graph_storage.h"

namespace riftmap {

/// Edges from the pixels [0, count) to those `ahead` behind them in memory. All arrays are readable
/// to count + ahead + kEdgePadding.
struct EdgeSpan {
    const VertexId* vertex = nullptr;     ///< of a pixel
    const std::uint8_t* fresh = nullptr;  ///< 1 = the vertex is new
    const std::uint16_t* code = nullptr;  ///< weight codes, ViewPoints::kNoEdge = none
    std::size_t count = 0, ahead = 0;
};
inline constexpr std::size_t kEdgePadding = 64;

/// Appends ends and code of the edges between different vertices that are not both new; returns
/// how many. The lists have room for count + kEdgePadding.
std::size_t listEdges(const EdgeSpan& span, VertexId* a, VertexId* b, std::uint32_t* code);

}  // namespace riftmap
