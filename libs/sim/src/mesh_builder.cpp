// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_builder.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace riftmap {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

}  // namespace

void MeshBuilder::material(const Material& material) {
    mesh_.materials.push_back(material);
}

void MeshBuilder::frame(const Point& origin, double yaw) {
    frame_.rotation = Eigen::AngleAxisd(yaw, Point::UnitZ()).toRotationMatrix();
    frame_.translation = origin;
}

std::uint32_t MeshBuilder::vertex(const Point& p) {
    mesh_.vertices.push_back((frame_ * p).cast<float>());
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
}

void MeshBuilder::triangle(const Point& a, const Point& b, const Point& c) {
    if ((b - a).cross(c - a).norm() < 1e-12) {
        return;  // poles of bodies of revolution
    }
    mesh_.triangles.push_back({vertex(a), vertex(b), vertex(c)});
    mesh_.materialOf.push_back(static_cast<std::uint32_t>(mesh_.materials.size() - 1));
}

void MeshBuilder::quad(const Point& a, const Point& b, const Point& c, const Point& d) {
    triangle(a, b, c);
    triangle(a, c, d);
}

void MeshBuilder::box(const Point& l, const Point& h, unsigned faces) {
    const auto p = [&](int x, int y, int z) {
        return Point(x ? h.x() : l.x(), y ? h.y() : l.y(), z ? h.z() : l.z());
    };
    if (faces & kMinX) {
        quad(p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0));
    }
    if (faces & kMaxX) {
        quad(p(1, 0, 0), p(1, 1, 0), p(1, 1, 1), p(1, 0, 1));
    }
    if (faces & kMinY) {
        quad(p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1));
    }
    if (faces & kMaxY) {
        quad(p(0, 1, 0), p(0, 1, 1), p(1, 1, 1), p(1, 1, 0));
    }
    if (faces & kBottom) {
        quad(p(0, 0, 0), p(0, 1, 0), p(1, 1, 0), p(1, 0, 0));
    }
    if (faces & kTop) {
        quad(p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1));
    }
}

void MeshBuilder::shell(const Point& min, const Point& max, unsigned faces) {
    const std::size_t first = mesh_.triangles.size();
    box(min, max, faces);
    for (std::size_t i = first; i < mesh_.triangles.size(); ++i) {
        std::swap(mesh_.triangles[i][1], mesh_.triangles[i][2]);
    }
}

void MeshBuilder::lathe(const Point& centre, const std::vector<Eigen::Vector2d>& profile,
                        int slices) {
    const auto at = [&](std::size_t ring, int slice) {
        const double angle = kTurn * (slice % slices) / slices;
        return Point(centre + Point(profile[ring].x() * std::cos(angle),
                                    profile[ring].x() * std::sin(angle), profile[ring].y()));
    };
    for (std::size_t ring = 0; ring + 1 < profile.size(); ++ring) {
        for (int slice = 0; slice < slices; ++slice) {
            quad(at(ring, slice), at(ring, slice + 1), at(ring + 1, slice + 1),
                 at(ring + 1, slice));
        }
    }
}

void MeshBuilder::cylinder(const Point& centre, double radius, double height, int slices,
                           unsigned faces) {
    std::vector<Eigen::Vector2d> profile;
    if (faces & kBottom) {
        profile.emplace_back(0, 0);
    }
    profile.emplace_back(radius, 0);
    profile.emplace_back(radius, height);
    if (faces & kTop) {
        profile.emplace_back(0, height);
    }
    lathe(centre, profile, slices);
}

void MeshBuilder::sphere(const Point& centre, double radius, int slices) {
    std::vector<Eigen::Vector2d> profile;
    const int rings = slices / 2;
    for (int i = 0; i <= rings; ++i) {
        const double angle = std::numbers::pi * i / rings;
        const bool pole = i == 0 || i == rings;
        profile.emplace_back(pole ? 0 : radius * std::sin(angle), -radius * std::cos(angle));
    }
    lathe(centre, profile, slices);
}

void MeshBuilder::tube(const std::function<Point(double)>& curve, double radius, int segments,
                       int slices, bool closed) {
    // A frame carried along the curve without twist; on a closed curve what twist is left over
    // at the end is spread evenly, so that the ends meet.
    const int rings = closed ? segments : segments + 1;
    std::vector<Point> centres, us, vs, tangents;
    const double h = 0.25 / segments;
    for (int i = 0; i <= segments; ++i) {
        const double s = static_cast<double>(i) / segments;
        centres.push_back(curve(s));
        const double before = closed ? s - h : std::max(0.0, s - h);
        const double after = closed ? s + h : std::min(1.0, s + h);
        tangents.push_back((curve(after) - curve(before)).normalized());
    }
    Point u = tangents[0].unitOrthogonal();
    for (int i = 0; i <= segments; ++i) {
        const Point& t = tangents[static_cast<std::size_t>(i)];
        u = (u - t * t.dot(u)).normalized();
        us.push_back(u);
        vs.push_back(t.cross(u));
    }
    const double twist = closed ? std::atan2(us.back().dot(vs[0]), us.back().dot(us[0])) : 0.0;
    const auto at = [&](int ring, int slice) {
        const auto i = static_cast<std::size_t>(ring % rings);
        const double angle = kTurn * (slice % slices) / slices -
                             twist * static_cast<double>(i) / static_cast<double>(segments);
        return Point(centres[i] + radius * (std::cos(angle) * us[i] + std::sin(angle) * vs[i]));
    };
    for (int ring = 0; ring < segments; ++ring) {
        for (int slice = 0; slice < slices; ++slice) {
            quad(at(ring, slice), at(ring, slice + 1), at(ring + 1, slice + 1),
                 at(ring + 1, slice));
        }
    }
    if (!closed) {
        for (int slice = 0; slice < slices; ++slice) {
            triangle(centres.front(), at(0, slice + 1), at(0, slice));
            triangle(centres.back(), at(segments, slice), at(segments, slice + 1));
        }
    }
}

void MeshBuilder::torus(const Point& centre, const Point& axis, double radius, double thickness,
                        int segments, int slices) {
    const Point n = axis.normalized();
    const Point u = n.unitOrthogonal();
    const Point v = n.cross(u);
    tube(
        [&](double s) -> Point {
            return centre + radius * (std::cos(kTurn * s) * u + std::sin(kTurn * s) * v);
        },
        thickness, segments, slices, true);
}

}  // namespace riftmap
