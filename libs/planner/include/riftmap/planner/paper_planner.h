// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "riftmap/core/options.h"
#include "riftmap/core/pose.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/astar.h"

namespace riftmap {

/// Section [PaperPlanner]: the planner of the paper (sec. VIII.B).
struct PaperPlannerOptions {
    double alpha = -0.1;      ///< of the distance through the graph in eq. (12) [1/m]
    double beta = 0.001;      ///< of the severity (number of edges) in eq. (12)
    double height = 1.0;      ///< of the camera above the surface [m]
    double step = 0.25;       ///< between the poses of a path, along the surface [m]
    double smoothing = 0.25;  ///< normals are averaged over this length to both sides [m]
    void describe(OptionTable& table);
};

/// Where the paper would go next. Map frame.
struct PaperPlan {
    static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

    std::vector<double> cost;      ///< eq. (12) of each rift of graph.rifts(); -inf: no way there
    std::size_t dominant = kNone;  ///< index of the rift with the highest cost
    /// A* path over the graph, from the camera's nearest vertex to the nearest vertex of the rift.
    GraphPath overGraph;
    /// Poses along it, looking at the surface; the last one looks along the rift's normal at its
    /// centre. Empty if there is no rift that can be reached.
    std::vector<Pose> poses;
};

/// Eq. (12), the dominant rift and the way to it. `search` keeps its buffers between calls. Throws
/// std::invalid_argument for a camera pose that is not valid. The path is not checked for
/// collisions: the paper assumes that the camera can take every pose (sec. X.B).
PaperPlan planPaper(const PixelGraph& graph, const Pose& camera, const PaperPlannerOptions& options,
                    GraphSearch& search);
PaperPlan planPaper(const PixelGraph& graph, const Pose& camera,
                    const PaperPlannerOptions& options);

}  // namespace riftmap
