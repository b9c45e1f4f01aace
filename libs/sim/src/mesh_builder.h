// SPDX-License-Identifier: BSD-3-Clause
// Building blocks of the built-in worlds.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "riftmap/core/pose.h"
#include "riftmap/sim/mesh.h"

namespace riftmap {

/// Faces of a box, to be combined.
enum Faces : unsigned {
    kMinX = 1U,
    kMaxX = 2U,
    kMinY = 4U,
    kMaxY = 8U,
    kBottom = 16U,
    kTop = 32U,
    kAllFaces = 63U,
    kOnFloor = kAllFaces & ~kBottom,
};

/// Adds solids, front sides outwards, in the present frame and material.
class MeshBuilder {
 public:
    using Point = Eigen::Vector3d;

    /// What follows is made of this.
    void material(const Material& material);
    /// What follows is given in this frame; the identity to begin with.
    void frame(const Pose& world_T_local) { frame_ = world_T_local; }
    void frame(const Point& origin, double yaw = 0);

    /// Corners anti-clockwise seen from the front.
    void triangle(const Point& a, const Point& b, const Point& c);
    void quad(const Point& a, const Point& b, const Point& c, const Point& d);
    void box(const Point& min, const Point& max, unsigned faces = kAllFaces);
    /// The inside of a box: front sides inwards.
    void shell(const Point& min, const Point& max, unsigned faces = kAllFaces);

    /// Body of revolution about the z axis through `centre`; the profile runs (radius, height)
    /// upwards on the outside. It is closed where the profile ends on the axis.
    void lathe(const Point& centre, const std::vector<Eigen::Vector2d>& profile, int slices);
    void cylinder(const Point& centre, double radius, double height, int slices,
                  unsigned faces = kAllFaces);
    void sphere(const Point& centre, double radius, int slices);
    /// Round tube of constant radius along a smooth curve over 0 .. 1; closed = the ends meet,
    /// otherwise they get caps.
    void tube(const std::function<Point(double)>& curve, double radius, int segments, int slices,
              bool closed);
    void torus(const Point& centre, const Point& axis, double radius, double thickness,
               int segments, int slices);

    TriangleMesh take() { return std::move(mesh_); }

 private:
    std::uint32_t vertex(const Point& p);

    TriangleMesh mesh_;
    Pose frame_;
};

}  // namespace riftmap
