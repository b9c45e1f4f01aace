// SPDX-License-Identifier: BSD-3-Clause
// Closed meshes with known area, front sides outwards.
#pragma once

#include <cmath>
#include <cstdint>

#include "riftmap/sim/mesh.h"

namespace riftmap::shapes {

inline constexpr double kPi = 3.141592653589793;

/// A grid of rows x columns points closed in both directions by `index`, as triangles.
template <class PointAt>
TriangleMesh wrapped(int rows, int columns, bool closedRows, PointAt&& pointAt) {
    TriangleMesh mesh;
    const int points = closedRows ? rows : rows + 1;
    for (int r = 0; r < points; ++r) {
        for (int c = 0; c < columns; ++c) {
            mesh.vertices.push_back(pointAt(r, c));
        }
    }
    const auto at = [&](int r, int c) {
        return static_cast<std::uint32_t>((r % points) * columns + c % columns);
    };
    for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < columns; ++c) {
            mesh.triangles.push_back({at(r, c), at(r + 1, c), at(r + 1, c + 1)});
            mesh.triangles.push_back({at(r, c), at(r + 1, c + 1), at(r, c + 1)});
        }
    }
    return mesh;
}

/// From the north pole down; some triangles at the poles have no area.
inline TriangleMesh sphere(double radius, int rows = 90) {
    return wrapped(rows, 2 * rows, false, [&](int r, int c) {
        const double t = kPi * r / rows;
        const double p = kPi * c / rows;
        return Eigen::Vector3d(radius * std::sin(t) * std::cos(p),
                               radius * std::sin(t) * std::sin(p), radius * std::cos(t))
            .cast<float>()
            .eval();
    });
}

inline TriangleMesh torus(double ring, double tube, int rows = 120) {
    return wrapped(rows, rows, true, [&](int r, int c) {
        const double t = 2 * kPi * r / rows;
        const double p = 2 * kPi * c / rows;
        const double d = ring + tube * std::sin(t);
        return Eigen::Vector3d(d * std::cos(p), d * std::sin(p), tube * std::cos(t))
            .cast<float>()
            .eval();
    });
}

/// Axis-aligned box; `inwards` turns the front sides in, as a room has them.
inline TriangleMesh box(const Eigen::Vector3f& min, const Eigen::Vector3f& max,
                        bool inwards = false) {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.vertices.emplace_back((i & 1) != 0 ? max.x() : min.x(),
                                   (i & 2) != 0 ? max.y() : min.y(),
                                   (i & 4) != 0 ? max.z() : min.z());
    }
    const std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
        mesh.triangles.push_back({q[0], q[1], q[2]});
        mesh.triangles.push_back({q[0], q[2], q[3]});
    }
    if (inwards) {
        for (auto& t : mesh.triangles) {
            std::swap(t[1], t[2]);
        }
    }
    return mesh;
}

}  // namespace riftmap::shapes
