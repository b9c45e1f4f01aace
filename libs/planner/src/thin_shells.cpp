// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/thin_shells.h"

#include <algorithm>
#include <array>
#include <optional>

#include "riftmap/core/parallel.h"
#include "riftmap/core/whole.h"

namespace riftmap {

namespace {

constexpr int kPieceBits = 2;  ///< a piece of the frontier: 4 voxels along each axis

}  // namespace

ThinShells::ThinShells(const FreeSpace& space, const SurfaceSummary& summary,
                       const std::vector<FreeSpace::Frontier>& frontier)
    : origin_(space.box().min()), voxel_(space.voxelSize()) {
    for (const auto& [key, block] : summary.blocks()) {
        for (const SurfaceCell& cell : block.cells) {
            if (cell.vertices < SurfaceSummary::kLeastVertices) {
                continue;
            }
            Surface& s = surface_[SurfaceSummary::keyAt(voxelOf(cell.position.cast<double>()))];
            s.normals += static_cast<float>(cell.vertices) * cell.oneSided * cell.normal;
            s.vertices += cell.vertices;
        }
    }
    std::vector<Around> seen(frontier.size());
    parallelForEach(frontier.size(), 16,
                    [&](std::size_t i) { seen[i] = lookAround(space, frontier[i]); });
    // By pieces of the frontier and those around: the inside may be one with what is unknown behind
    // a side that was not seen yet.
    const auto pieceOf = [&](const FreeSpace::Frontier& place) {
        return Eigen::Vector3i(
            voxelOf(place.centre.cast<double>()).unaryExpr([](int x) { return x >> kPieceBits; }));
    };
    std::unordered_map<std::uint64_t, Around> pieces;
    for (std::size_t i = 0; i < frontier.size(); ++i) {
        pieces[SurfaceSummary::keyAt(pieceOf(frontier[i]))] += seen[i];
    }
    std::unordered_set<std::uint64_t> within;
    for (const auto& piece : pieces) {
        constexpr int kLeast = 100;  // [backs] fewer may be a fold, and promise little
        Around all;
        for (int i = 0; i < kCubeOfVoxels; ++i) {
            const auto it = pieces.find(
                SurfaceSummary::keyAt(SurfaceSummary::indexOf(piece.first) + aroundVoxel(i)));
            if (it != pieces.end()) {
                all += it->second;
            }
        }
        if (all.backs >= kLeast && 2 * all.backs > all.all) {
            within.insert(piece.first);
        }
    }
    for (std::size_t i = 0; i < frontier.size(); ++i) {
        // Among them a place that hardly sees a back itself is before the outside: a patch not seen
        // yet that the inside lies behind.
        if (within.contains(SurfaceSummary::keyAt(pieceOf(frontier[i]))) &&
            4 * seen[i].backs >= seen[i].all) {
            inside_.insert(SurfaceSummary::keyAt(voxelOf(frontier[i].centre.cast<double>())));
        }
    }
}

bool ThinShells::hold(const FreeSpace::Frontier& place) const {
    return inside_.contains(SurfaceSummary::keyAt(voxelOf(place.centre.cast<double>())));
}

bool ThinShells::touch(const Eigen::Vector3d& place) const {
    for (int i = 0; i < kCubeOfVoxels; ++i) {
        if (inside_.contains(SurfaceSummary::keyAt(voxelOf(place) + aroundVoxel(i)))) {
            return true;
        }
    }
    return false;
}

Eigen::Vector3i ThinShells::voxelOf(const Eigen::Vector3d& place) const {
    return wholesBelow((place - origin_) / voxel_);
}

/// To the 26 sides, through the space that is known, from a free voxel before this one.
ThinShells::Around ThinShells::lookAround(const FreeSpace& space,
                                          const FreeSpace::Frontier& place) const {
    // Of the mean normal's length: the corner of a cube, seen from its three sides, has 0.58.
    constexpr float kBothSides = 0.55F;
    constexpr float kBack = 0.2F;  // cosine
    std::optional<Eigen::Vector3d> start;
    for (int axis = 0; axis < 3 && !start; ++axis) {
        const auto area = static_cast<double>(place.area[axis]);
        Eigen::Vector3d p = place.centre.cast<double>();
        p[axis] += area > 0 ? voxel_ : -voxel_;
        if (area != 0 && space.at(p) == FreeSpace::State::kFree) {
            start = p;
        }
    }
    Around result;
    std::array<std::uint64_t, kCubeOfVoxels> met{};  // each piece of surface counts once
    std::size_t pieces = 0;
    for (int i = 0; i < kCubeOfVoxels && start; ++i) {
        const Eigen::Vector3d way = aroundVoxel(i).cast<double>().normalized();
        if (way.isZero()) {
            continue;
        }
        Eigen::Vector3d p = *start;
        while (space.box().contains(p) && space.at(p) == FreeSpace::State::kFree) {
            p += 0.9 * voxel_ * way;
        }
        const std::uint64_t key = SurfaceSummary::keyAt(voxelOf(p));
        const auto end = met.begin() + static_cast<std::ptrdiff_t>(pieces);
        if (!space.box().contains(p)) {
            ++result.all;
        } else if (const auto it = surface_.find(key);
                   it != surface_.end() && std::find(met.begin(), end, key) == end) {
            met[pieces++] = key;
            const Eigen::Vector3f mean =
                it->second.normals / static_cast<float>(it->second.vertices);
            const bool back =
                mean.norm() < kBothSides || mean.dot(way.cast<float>()) > kBack * mean.norm();
            result.backs += back ? 1 : 0;
            ++result.all;
        }
    }
    return result;
}

}  // namespace riftmap
