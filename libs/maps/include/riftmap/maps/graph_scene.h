// SPDX-License-Identifier: BSD-3-Clause
// A pixel graph as stock objects of mrpt::opengl: what stands in a .3Dscene opens in SceneViewer3D
// without a plug-in.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "riftmap/core/pose.h"
#include "riftmap/graph/pixel_graph.h"

namespace mrpt::opengl {
class CSetOfObjects;
}

namespace riftmap {

/// Colour of an edge by its weight: green at 0 over yellow to red at `high` and above (Fig. 1d).
struct EdgeColour {
    float red, green, blue;  ///< 0 .. 1
};
EdgeColour edgeColour(float weight, float high);

/// The coloured vertices as one cloud "points", the high edges as lines "high edges" in red.
void addGraph(mrpt::opengl::CSetOfObjects& scene, const PixelGraph& graph);

/// An arrow along the normal of each rift, `length` [m] long (a ball where the normal is not
/// known), in a group "rifts": blue, the dominant one red and twice as long.
void addRifts(mrpt::opengl::CSetOfObjects& scene, const std::vector<Rift>& rifts,
              std::optional<std::size_t> dominant, double length);

/// A green line through the poses with a small pyramid at each, in a group of that name.
void addCameraPath(mrpt::opengl::CSetOfObjects& scene, const char* name,
                   const std::vector<Pose>& world_T_camera, double size);

/// What a scene file shows besides the graph. Map frame.
struct SceneExtras {
    std::vector<Pose> taken;              ///< poses views were taken from
    std::vector<Pose> planned;            ///< the planned way
    std::optional<std::size_t> dominant;  ///< index into the graph's rifts
};

/// Writes a .3Dscene. Throws FileError.
void saveScene(const std::filesystem::path& file, const PixelGraph& graph,
               const SceneExtras& extras = {});

}  // namespace riftmap
