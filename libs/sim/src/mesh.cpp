// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/mesh.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>

namespace riftmap {
namespace {

constexpr double kSmallestSize = 1e-3;  // [m]
constexpr double kLargestSize = 2e3;    // [m] single precision is 0.1 mm here

void mix(std::uint64_t& hash, const void* data, std::size_t bytes) {
    const auto* p = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < bytes; ++i) {
        hash = (hash ^ p[i]) * 1099511628211ULL;
    }
}

std::string number(double x) {
    char buffer[32];
    std::snprintf(buffer, sizeof(buffer), "%.4g", x);
    return buffer;
}

}  // namespace

std::array<Eigen::Vector3d, 3> TriangleMesh::corners(std::size_t triangle) const {
    const auto& t = triangles[triangle];
    return {vertices[t[0]].cast<double>(), vertices[t[1]].cast<double>(),
            vertices[t[2]].cast<double>()};
}

Eigen::Vector3d TriangleMesh::normal(std::size_t triangle) const {
    const auto c = corners(triangle);
    const Eigen::Vector3d n = (c[1] - c[0]).cross(c[2] - c[0]);
    const double length = n.norm();
    return length > 0 ? Eigen::Vector3d(n / length) : Eigen::Vector3d::Zero();
}

double TriangleMesh::area(std::size_t triangle) const {
    const auto c = corners(triangle);
    return (c[1] - c[0]).cross(c[2] - c[0]).norm() / 2;
}

Bounds bounds(const TriangleMesh& mesh) {
    Bounds b;
    for (const auto& t : mesh.triangles) {
        for (const auto i : t) {
            const Eigen::Vector3d v = mesh.vertices[i].cast<double>();
            b.min = b.min.cwiseMin(v);
            b.max = b.max.cwiseMax(v);
        }
    }
    return b;
}

double area(const TriangleMesh& mesh) {
    double sum = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        sum += mesh.area(i);
    }
    return sum;
}

std::uint64_t hashOf(const TriangleMesh& mesh) {
    std::uint64_t hash = 14695981039346656037ULL;
    for (const auto& v : mesh.vertices) {
        mix(hash, v.data(), 3 * sizeof(float));
    }
    for (const auto& t : mesh.triangles) {
        mix(hash, t.data(), 3 * sizeof(std::uint32_t));
    }
    return hash;
}

void append(TriangleMesh& a, const TriangleMesh& b) {
    const auto pad = [](auto& to, const auto& from, std::size_t before, std::size_t added,
                        const auto& filler) {
        if (to.empty() && from.empty()) {
            return;
        }
        to.resize(before, filler);
        to.insert(to.end(), from.begin(), from.end());
        to.resize(before + added, filler);
    };
    const std::size_t vertices = a.vertices.size();
    const std::size_t triangles = a.triangles.size();
    pad(a.uv, b.uv, vertices, b.vertices.size(), Eigen::Vector2f(0, 0));
    pad(a.colours, b.colours, vertices, b.vertices.size(), Eigen::Vector3f(1, 1, 1));
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());

    if (a.materials.empty()) {
        a.materials.emplace_back();
    }
    a.materialOf.resize(triangles, 0);
    const auto firstMaterial = static_cast<std::uint32_t>(a.materials.size());
    a.materials.insert(a.materials.end(), b.materials.begin(), b.materials.end());
    for (std::size_t i = 0; i < b.triangles.size(); ++i) {
        std::array<std::uint32_t, 3> t = b.triangles[i];
        for (auto& index : t) {
            index += static_cast<std::uint32_t>(vertices);
        }
        a.triangles.push_back(t);
        const std::uint32_t own = b.materialOf.empty() ? 0 : b.materialOf[i];
        a.materialOf.push_back(b.materials.empty() ? 0 : firstMaterial + own);
    }
}

void validate(const TriangleMesh& mesh, const std::string& name) {
    if (mesh.triangles.empty()) {
        throw MeshError(name + ": no triangles");
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (const auto index : mesh.triangles[i]) {
            if (index >= mesh.vertices.size()) {
                throw MeshError(name + ": triangle " + std::to_string(i) + " uses vertex " +
                                std::to_string(index) + " of " +
                                std::to_string(mesh.vertices.size()));
            }
        }
    }
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        if (!mesh.vertices[i].allFinite()) {
            throw MeshError(name + ": vertex " + std::to_string(i) + " is not finite");
        }
    }
    const Bounds b = bounds(mesh);
    const double size = b.size().maxCoeff();
    const double reach = std::max(b.min.cwiseAbs().maxCoeff(), b.max.cwiseAbs().maxCoeff());
    if (size < kSmallestSize || size > kLargestSize || reach > 2 * kLargestSize) {
        throw MeshError(
            name + ": " + number(size) + " m across, up to " + number(reach) +
            " m from the origin; a world is 1 mm .. 2 km across: is the file in metres? "
            "(World.scale, World.size)");
    }
}

}  // namespace riftmap
