// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "riftmap/core/view.h"

namespace riftmap {

/// An OctoMap and a map of ours of the same observations, voxel by voxel at the same resolution.
struct OctomapComparison {
    double resolution = 0;                  ///< [m]
    std::size_t views = 0;                  ///< that went into the OctoMap
    std::size_t occupied = 0;               ///< voxels of the OctoMap
    std::size_t free = 0;                   ///< voxels of the OctoMap
    std::size_t ours = 0;                   ///< voxels that hold a vertex of ours
    std::size_t occupiedWithoutVertex = 0;  ///< occupied voxels that hold no vertex of ours ...
    std::size_t occupiedFarFromVertex = 0;  ///< ... and have none in the 26 voxels around either
    std::size_t vertices = 0;
    std::size_t verticesInFree = 0;     ///< vertices of ours in free voxels ...
    std::size_t verticesFarInFree = 0;  ///< ... with no occupied voxel among the 26 around
    std::size_t verticesInUnknown = 0;  ///< in voxels that the OctoMap knows nothing of

    // Against the true surface; 0 voxels where there is none.
    std::size_t surfaceVoxels = 0;        ///< that hold a ground-truth sample
    std::size_t surfaceOccupied = 0;      ///< of them, occupied in the OctoMap
    std::size_t surfaceOurs = 0;          ///< of them, holding a vertex of ours
    std::size_t onlyOccupied = 0;         ///< of them, occupied but without a vertex of ours
    std::size_t onlyOurs = 0;             ///< of them, with a vertex but not occupied ...
    std::size_t onlyOursFree = 0;         ///< ... because later rays carved them free
    std::size_t surfaceOccupiedNear = 0;  ///< occupied, or one of the 26 around is
    std::size_t surfaceOursNear = 0;      ///< holding a vertex, or one of the 26 around does

    double octomapCoverage() const;  ///< surfaceOccupied / surfaceVoxels; NaN without
    double ourCoverage() const;      ///< surfaceOurs / surfaceVoxels; NaN without
    double octomapCoverageNear() const;
    double ourCoverageNear() const;
};

/// Who has a voxel.
enum class VoxelOwner { kNeither, kBoth, kOnlyOctomap, kOnlyOurs };

/// The cross-check of coverage_protocol.md with liboctomap itself (not MRPT's wrapping of it).
/// Not thread-safe.
class OctomapCheck {
 public:
    /// Throws std::invalid_argument unless resolution > 0 [m].
    explicit OctomapCheck(double resolution);
    ~OctomapCheck();
    OctomapCheck(OctomapCheck&&) noexcept;
    OctomapCheck& operator=(OctomapCheck&&) noexcept;

    /// Points in the map frame as seen from `origin`; those that are not finite are left out.
    void insert(std::span<const Eigen::Vector3f> cloud, const Eigen::Vector3f& origin);
    /// Every valid pixel of the view, back-projected into the map frame.
    void insert(const View& view);

    /// `surface`: ground-truth samples (the observable ones), or empty.
    OctomapComparison compare(std::span<const Eigen::Vector3f> vertices,
                              std::span<const Eigen::Vector3f> surface) const;

    /// Tells who has the voxel of a point. Valid as long as this object; thread-safe while nothing
    /// is inserted.
    std::function<VoxelOwner(const Eigen::Vector3f&)> owners(
        std::span<const Eigen::Vector3f> vertices) const;

    /// True if the voxel of this point is occupied.
    bool occupied(const Eigen::Vector3f& point) const;

 private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace riftmap
