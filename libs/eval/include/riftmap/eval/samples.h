// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "riftmap/eval/eval_options.h"
#include "riftmap/sim/mesh.h"

namespace riftmap {

/// Points spread evenly by area over a mesh: each stands for the same area.
struct SurfaceSamples {
    std::vector<Eigen::Vector3f> points;   ///< world frame [m]
    std::vector<Eigen::Vector3f> normals;  ///< of their triangles, unit, by the order of corners
    double area = 0;                       ///< of the mesh [m^2]
    std::uint64_t seed = 0;
    std::uint64_t meshHash = 0;
};

/// The kind that kAuto stands for.
WorldKind worldKind(const TriangleMesh& mesh, WorldKind asked);

/// How many samples the protocol asks of this mesh.
std::size_t sampleCount(const TriangleMesh& mesh, const EvalOptions& options);

/// The protocol's ground truth, stratified along the cumulated area (the share of samples on any
/// part is its share of the area but for one sample a triangle strip). Throws
/// std::invalid_argument for a mesh without area.
SurfaceSamples groundTruthSamples(const TriangleMesh& mesh, const EvalOptions& options);

}  // namespace riftmap
