// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "riftmap/graph/pixel_graph.h"

namespace riftmap {

struct AstarComparison {
    double ownMs = 0, boostMs = 0;  ///< medians of a search
    double ratio = 0;               ///< median of Boost's time over ours
    double largestDifference = 0;   ///< of the lengths found, relative
    std::size_t searches = 0, unreachable = 0;
};

/// A* between random vertices by turns with Boost.Graph's over the same edges in a compressed-row
/// graph; both take the straight line as heuristic and the same lengths of edges.
AstarComparison compareAstar(const PixelGraph& graph, std::size_t searches);

}  // namespace riftmap
