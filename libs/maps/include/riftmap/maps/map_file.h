// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "riftmap/core/ply.h"
#include "riftmap/maps/pixel_graph_map.h"

namespace riftmap {

/// Writes `map.pixelgraph`: the map serialised by MRPT, gzipped, read back once (MRPT does not
/// notice a full disk). Throws FileError.
void saveMap(const std::filesystem::path& file, const PixelGraphMap& map);

/// Reads such a file. Throws FileError that names what is damaged.
PixelGraphMap loadMap(const std::filesystem::path& file);

/// Positions, normals and colours of all vertices, in the order of their ids: `graph.ply`.
PointCloud cloudOf(const PixelGraph& graph);

}  // namespace riftmap
