// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "riftmap/planner/free_space.h"
#include "riftmap/planner/surface_summary.h"

namespace riftmap {

/// Hollow bodies with walls of no thickness, as scanned meshes with an open base are: what can be
/// seen inside of them is the other side of surface that the map has, though every view into them
/// opens up more unknown space. A place of the frontier counts as the inside of one if, looking
/// around from the free space before the frontier near it (of 12 voxels along each axis), most of
/// what stops the view is the back of known surface, or surface that was seen from both sides.
/// Before the outside of a body, and in one with thick walls, it is the front; fewer than 100 backs
/// are not judged, for a fold of the surface may look like that. A place where less than a quarter
/// of what stops the view is backs does not count either: it is before a patch of the outside that
/// was not seen yet, with the inside behind it. Walls thinner than a voxel of the
/// frontier (2.5 cm at a resolution of 5 mm, see Knowledge::unseen()) cannot be told from those of
/// no thickness. Map frame, metres. Thread-safe once it is made.
class ThinShells {
 public:
    /// `frontier`: all of `space`. `space` must know the surface of `summary`, and is not needed
    /// afterwards. Time: in proportion to the cells, and to the frontier
    /// times the edge of the space in voxels.
    ThinShells(const FreeSpace& space, const SurfaceSummary& summary,
               const std::vector<FreeSpace::Frontier>& frontier);

    /// True if this place of the frontier lies inside of a shell.
    bool hold(const FreeSpace::Frontier& place) const;
    /// True if this place lies in a voxel of the frontier inside of a shell, or in one that touches
    /// it. O(1).
    bool touch(const Eigen::Vector3d& place) const;

 private:
    struct Surface {
        Eigen::Vector3f normals = Eigen::Vector3f::Zero();  ///< sum over the vertices
        std::uint32_t vertices = 0;
    };
    /// What stops the view from a place.
    struct Around {
        int backs = 0;  ///< of surface
        int all = 0;    ///< with fronts, and ways that lead out of the space
        Around& operator+=(const Around& other) {
            backs += other.backs;
            all += other.all;
            return *this;
        }
    };
    Eigen::Vector3i voxelOf(const Eigen::Vector3d& place) const;
    Around lookAround(const FreeSpace& space, const FreeSpace::Frontier& place) const;

    Eigen::Vector3d origin_;
    double voxel_;
    std::unordered_map<std::uint64_t, Surface> surface_;  ///< by voxel
    std::unordered_set<std::uint64_t> inside_;            ///< voxels of the frontier
};

}  // namespace riftmap
