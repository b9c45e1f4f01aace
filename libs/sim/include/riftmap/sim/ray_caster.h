// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "riftmap/sim/mesh.h"

namespace riftmap {

/// Where a ray meets the surface. World frame.
struct Hit {
    double t = 0;                ///< in lengths of the ray's direction
    std::uint32_t triangle = 0;  ///< index into TriangleMesh::triangles
    float u = 0, v = 0;  ///< barycentric: point = (1 - u - v) * corner0 + u * corner1 + v * corner2
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, of the triangle's front side
};

/// The surface point nearest to a query.
struct Closest {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< [m]
    double distance = 0;                              ///< [m]
    std::uint32_t triangle = 0;
};

/// Rays and distances against a mesh (Embree inside). Keeps its own copy of the triangles.
/// World frame, metres. All const members may be called from any number of threads at once; the
/// answers do not depend on the number of threads.
class RayCaster {
 public:
    /// Throws MeshError if Embree cannot build the scene, or for what validate(mesh) finds.
    explicit RayCaster(const TriangleMesh& mesh);
    ~RayCaster();
    RayCaster(RayCaster&&) noexcept;
    RayCaster& operator=(RayCaster&&) noexcept;

    /// First triangle, either side, with 0 < t <= tMax along origin + t * direction. The direction
    /// need not have unit length: with one of z = 1 in a camera's frame, t is the depth.
    std::optional<Hit> cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                            double tMax = std::numeric_limits<double>::infinity()) const;

    /// The same for many rays from one origin that run side by side, as those of a row of pixels
    /// do: more than twice as fast. Where a ray runs exactly through an edge it may name the other
    /// triangle than `cast`.
    void castBundle(const Eigen::Vector3d& origin, std::span<const Eigen::Vector3d> directions,
                    std::span<std::optional<Hit>> hits) const;

    /// True if a surface lies strictly between a and b. Surfaces within `margin` [m] of either end
    /// do not count, so that a point on the surface does not hide itself.
    bool occluded(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double margin = 1e-4) const;

    /// Nearest surface point within maxDistance [m] of `point`.
    std::optional<Closest> closest(const Eigen::Vector3d& point, double maxDistance) const;

    /// Least distance [m] from the segment a-b to any surface, exactly; maxDistance if none is
    /// nearer. Time grows with the triangles within maxDistance of the segment.
    double sweptDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                         double maxDistance) const;

    /// True if a ball of radius `clearance` [m] can move straight from a to b and touch nothing.
    bool sweptClear(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double clearance) const;

 private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
};

}  // namespace riftmap
