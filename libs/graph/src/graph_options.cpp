// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/graph/pixel_graph.h"

namespace riftmap {

void GraphOptions::describe(OptionTable& table) {
    table.section("Graph", "The pixel graph: when surface counts as seen, and what is one point.");
    table.add("target_resolution", targetResolution, 1e-4, 10.0, "m",
              "Spacing and two standard deviations that the surface is asked to have.");
    table.add("delta", delta, 0.0, 1e3, "m",
              "Weight above which an edge is high; 0 = target_resolution plus what noise and "
              "viewing angle explain.");
    table.add("gamma", gamma, 1e-5, 10.0, "m",
              "Distance within which a pixel and a vertex are the same point (Algorithm 2).");
    table.add("visibility", visibility, 0.0, 1.0, "",
              "Share of a high edge's pixels that must show surface behind it to delete it.");
    table.addChoice<Fusion>(
        "fusion", fusion,
        {{"first", Fusion::kFirst}, {"inverse_variance", Fusion::kInverseVariance}},
        "What happens to a vertex seen again: keeps its first position (the paper), or is fused.");
    table.add("typed_openness", typedOpenness,
              "Vertices are open also at image borders, beside pixels without a match and where "
              "sampled too coarsely; off: only at depth steps (the paper).");
    table.add("block_size", blockSize, 0.05, 100.0, "m", "Edge of a spatial block.");
    table.add("rift_extent", riftExtent, 0.0, 100.0, "m",
              "Rifts are cut at the faces of cubes of this edge (a multiple of block_size); 0 = "
              "uncut (the paper).");
}

}  // namespace riftmap
