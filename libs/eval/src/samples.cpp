// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/samples.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace riftmap {

namespace {

constexpr double kObjectSide = 2.5;  // [m]
constexpr double kIndoorSide = 25;   // [m]
constexpr std::size_t kObjectSamples = 10000;
constexpr double kLeastRoomSamples = 200000;
constexpr double kSamplesPerSquareMetre = 1e4;  // one a cm^2

/// Uniform in [0, 1): the same on every machine, unlike std::uniform_real_distribution.
double uniform(std::mt19937_64& random) {
    return static_cast<double>(random() >> 11) * 0x1p-53;
}

}  // namespace

WorldKind worldKind(const TriangleMesh& mesh, WorldKind asked) {
    if (asked != WorldKind::kAuto) {
        return asked;
    }
    const double side = bounds(mesh).size().maxCoeff();
    if (side <= kObjectSide) {
        return WorldKind::kObject;
    }
    return side <= kIndoorSide ? WorldKind::kIndoor : WorldKind::kOutdoor;
}

std::size_t sampleCount(const TriangleMesh& mesh, const EvalOptions& options) {
    if (options.samples > 0) {
        return static_cast<std::size_t>(options.samples);
    }
    if (worldKind(mesh, options.kind) == WorldKind::kObject) {
        return kObjectSamples;
    }
    const double byArea = std::max(kLeastRoomSamples, area(mesh) * kSamplesPerSquareMetre);
    return static_cast<std::size_t>(std::min(byArea, static_cast<double>(options.maxSamples)));
}

SurfaceSamples groundTruthSamples(const TriangleMesh& mesh, const EvalOptions& options) {
    SurfaceSamples out;
    out.seed = options.sampleSeed;
    out.meshHash = hashOf(mesh);
    out.area = area(mesh);
    if (!(out.area > 0) || !std::isfinite(out.area)) {
        throw std::invalid_argument("the world's mesh has no surface to sample (area " +
                                    std::to_string(out.area) + " m^2)");
    }
    const std::size_t count = sampleCount(mesh, options);
    out.points.reserve(count);
    out.normals.reserve(count);
    std::mt19937_64 random(options.sampleSeed);
    std::size_t triangle = 0;
    double end = mesh.area(0);  // of this triangle, along the cumulated area
    for (std::size_t i = 0; i < count; ++i) {
        const double at =
            (static_cast<double>(i) + uniform(random)) / static_cast<double>(count) * out.area;
        while (at >= end && triangle + 1 < mesh.triangles.size()) {
            end += mesh.area(++triangle);
        }
        const auto [a, b, c] = mesh.corners(triangle);
        const double root = std::sqrt(uniform(random));
        const double along = uniform(random);
        const Eigen::Vector3d p = (1 - root) * a + root * (1 - along) * b + root * along * c;
        out.points.push_back(p.cast<float>());
        out.normals.push_back(mesh.normal(triangle).cast<float>());
    }
    return out;
}

}  // namespace riftmap
