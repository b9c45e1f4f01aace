// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "riftmap/core/view.h"
#include "riftmap/eval/map_surface.h"

namespace riftmap {

/// An OctoMap and a map of ours of the same observations, voxel by voxel at the same resolution.
/// A voxel is *ours* if our surface, give or take its standard deviation, passes through it.
struct OctomapComparison {
    double resolution = 0;                ///< [m]
    std::size_t views = 0;                ///< that went into the OctoMap
    std::size_t occupied = 0;             ///< voxels of the OctoMap
    std::size_t free = 0;                 ///< voxels of the OctoMap
    std::size_t ours = 0;                 ///< voxels that our surface passes through
    std::size_t occupiedNotOurs = 0;      ///< occupied voxels without our surface ...
    std::size_t occupiedFarFromOurs = 0;  ///< ... and without it in the 26 voxels around either
    std::size_t vertices = 0;
    std::size_t verticesInFree = 0;     ///< vertices of ours in free voxels ...
    std::size_t verticesFarInFree = 0;  ///< ... with no occupied voxel among the 26 around
    std::size_t verticesInUnknown = 0;  ///< in voxels that the OctoMap knows nothing of

    // Against the true surface; 0 voxels where there is none.
    std::size_t surfaceVoxels = 0;        ///< that hold a ground-truth sample
    std::size_t surfaceOccupied = 0;      ///< of them, occupied in the OctoMap
    std::size_t surfaceOurs = 0;          ///< of them, ours
    std::size_t surfaceVertex = 0;        ///< of them, holding a vertex of ours
    std::size_t surfaceOccupiedNear = 0;  ///< occupied, or one of the 26 around is
    std::size_t surfaceOursNear = 0;      ///< ours, or one of the 26 around is
    std::size_t occupiedOffSurface = 0;   ///< occupied voxels without a sample ...
    std::size_t occupiedFarOff = 0;       ///< ... and without one in the 26 around: noise
    std::size_t oursOffSurface = 0;       ///< our voxels without a sample ...
    std::size_t oursFarOff = 0;           ///< ... and without one in the 26 around

    // Why only one has a surface voxel.
    std::size_t onlyOccupiedClipped = 0;  ///< the truth only clips it (VoxelOwner)
    std::size_t onlyOccupiedBeside = 0;   ///< not clipped; our surface runs through one beside it
    std::size_t onlyOccupiedMissed = 0;   ///< our surface is nowhere near
    std::size_t onlyOursFree = 0;         ///< rays of other views carved it free
    std::size_t onlyOursUnknown = 0;      ///< no ray of any view ended in it or went through

    double octomapCoverage() const;  ///< surfaceOccupied / surfaceVoxels; NaN without
    double ourCoverage() const;      ///< surfaceOurs / surfaceVoxels; NaN without
    double vertexCoverage() const;   ///< surfaceVertex / surfaceVoxels; NaN without
    double octomapCoverageNear() const;
    double ourCoverageNear() const;
};

/// Who has a voxel of the true surface; of those that only one has, why.
enum class VoxelOwner {
    kNeither,
    kBoth,
    kOctomapClipped,  ///< the true surface fills less than a tenth of a face's area there
    kOctomapBeside,
    kOctomapMissed,
    kOursCarved,
    kOursUnknown,
};

/// Tells who has the voxel of a point on the true surface.
using VoxelOwners = std::function<VoxelOwner(const Eigen::Vector3f&)>;

/// Points of the true surface with their unit normals; of equal number.
struct TrueSurface {
    std::vector<Eigen::Vector3f> points, normals;
};

/// Area [m^2] of the part of a plane inside an axis-aligned cube. `normal`: unit.
double sectionArea(const Eigen::Vector3d& cubeMin, double edge, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& normal);

/// The cross-check of coverage_protocol.md with liboctomap itself (not MRPT's wrapping of it).
/// Not thread-safe.
class OctomapCheck {
 public:
    /// `shift`: of the voxels against the map frame, in edges of a voxel. Walls of worlds made by
    /// hand lie exactly where voxels meet, and rounding would choose the side.
    /// Throws std::invalid_argument unless resolution > 0 [m].
    explicit OctomapCheck(double resolution,
                          const Eigen::Vector3f& shift = Eigen::Vector3f::Zero());
    ~OctomapCheck();
    OctomapCheck(OctomapCheck&&) noexcept;
    OctomapCheck& operator=(OctomapCheck&&) noexcept;

    /// Points in the map frame as seen from `origin`; those that are not finite are left out.
    void insert(std::span<const Eigen::Vector3f> cloud, const Eigen::Vector3f& origin);
    /// Every valid pixel of the view, back-projected into the map frame.
    void insert(const View& view);

    /// Of our map's surface; without triangles our voxels are those that hold a vertex. `truth`:
    /// the observable ground-truth samples, or empty.
    OctomapComparison compare(const MapSurface& map, const TrueSurface& truth = {}) const;

    /// Valid as long as this object; thread-safe while nothing is inserted.
    VoxelOwners owners(const MapSurface& map, const TrueSurface& truth) const;

    /// True if the voxel of this point is occupied.
    bool occupied(const Eigen::Vector3f& point) const;

 private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace riftmap
