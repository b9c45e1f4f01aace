// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "riftmap/graph/pixel_graph.h"

namespace riftmap {

/// A map as a surface. Map frame [m].
struct MapSurface {
    std::vector<Eigen::Vector3f> vertices;
    /// Corners as indices of vertices; an edge without surface beside it has its second end twice.
    /// Where four vertices make a quadrangle of pixels, its triangles overlap. Empty for a map of
    /// which only points are known.
    std::vector<std::array<std::uint32_t, 3>> triangles;
    /// Of each vertex: its standard deviation along its normal [m]. Empty where it is not known.
    std::vector<Eigen::Vector3f> deviations;
};

/// The surface between a graph's neighbouring vertices, those in ascending order of id: each pair
/// of low edges that meet at less than about a right angle spans a triangle, and each low edge
/// stands for itself. O(edges).
MapSurface surfaceOf(const PixelGraph& graph);

/// Places of the vertices of all rifts [m]: the rims that the coverage protocol calls listed. Calls
/// PixelGraph::rifts(), which counts as writing; else O(vertices of rifts).
std::vector<Eigen::Vector3f> rimsOf(const PixelGraph& graph);

}  // namespace riftmap
