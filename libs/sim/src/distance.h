// SPDX-License-Identifier: BSD-3-Clause
// Distances between points, segments and triangles, in double precision.
#pragma once

#include <Eigen/Core>
#include <array>

namespace riftmap {

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Point of the triangle nearest to p. Triangles without area are segments or points.
Eigen::Vector3d closestPoint(const Eigen::Vector3d& p, const Triangle& triangle);

/// Least distance from the segment a-b to the triangle; 0 where they meet.
double segmentDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                       const Triangle& triangle);

/// Least distance between the segments a-b and c-d.
double segmentDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d);

}  // namespace riftmap
