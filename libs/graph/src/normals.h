// SPDX-License-Identifier: BSD-3-Clause
// Section VIII.A of the paper.
#pragma once

#include <Eigen/Core>

#include "riftmap/graph/graph_storage.h"

namespace riftmap {

/// Eqs. (9)-(11): normal of the plane through a vertex and its neighbours in the graph, towards
/// `camera`. `acrossHigh`: neighbours across high edges count too (the paper). Zero where the
/// points span no plane.
Eigen::Vector3f planeNormal(const GraphStorage& storage, VertexId id, const Eigen::Vector3f& camera,
                            bool acrossHigh);

}  // namespace riftmap
