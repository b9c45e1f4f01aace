// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "riftmap/graph/pixel_graph.h"

namespace riftmap {

struct AstarComparison {
    double ownMs = 0, boostMs = 0;           ///< medians over pairs of the medians over turns
    double ownExpansions = 0;                ///< mean of our searches
    double ratio = 0;                        ///< median over pairs of Boost's time over ours
    double lowestTurn = 0, highestTurn = 0;  ///< Boost's time over ours, all pairs of one turn
    double largestDifference = 0;            ///< of the lengths found, relative
    std::size_t searches = 0, unreachable = 0;
};

/// A* between random pairs of vertices by turns with Boost.Graph's over the same edges in a
/// compressed-row graph; both take the straight line as heuristic and the same lengths of edges,
/// keep their buffers from search to search and have found each path once before.
AstarComparison compareAstar(const PixelGraph& graph, std::size_t pairs, std::size_t turns);

}  // namespace riftmap
