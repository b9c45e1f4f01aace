// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "riftmap/core/view.h"
#include "riftmap/core/whole.h"
#include "riftmap/planner/sensor_model.h"

namespace riftmap {

/// Voxels of a cube of three along each edge.
inline constexpr int kCubeOfVoxels = 27;
/// Offset of voxel i of them from the middle one, which has the index 13; x goes first.
inline Eigen::Vector3i aroundVoxel(int i) {
    return {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
}

/// What the pixels of a view without a match show, from FreeSpace::emptyPixels(); row by row.
struct EmptyPixels {
    std::vector<float> depth;  ///< [m] before which there is nothing; 0: not known, or matched
    std::vector<std::uint8_t> proven;  ///< 1: so sure that the pixel counts as measured
};

/// What is known of the space between the surfaces, from what the views saw through: a byte a
/// voxel over the workspace. A voxel is free if some view measured only surfaces behind the whole
/// of it. Answers where the camera may fly, how far that is, and where the unknown begins.
/// Map frame, metres. Reading is thread-safe while nothing writes.
class FreeSpace {
 public:
    enum class State { kUnknown, kFree, kSurface };
    /// Whether the camera fits at a place [m].
    using Fits = std::function<bool(const Eigen::Vector3d&)>;

    /// Covers `box`. Throws std::invalid_argument for an empty box, a voxel size that is not
    /// positive or more than 2^27 voxels.
    FreeSpace(const Eigen::AlignedBox3d& box, double voxelSize);

    double voxelSize() const { return voxel_; }
    std::size_t voxelCount() const { return voxels_.size(); }
    const Eigen::AlignedBox3d& box() const { return box_; }

    /// Free because it is known beforehand: everything outside of `surfaces`.
    void declareFreeOutside(const Eigen::AlignedBox3d& surfaces);
    /// Free because the camera is there with its clearance.
    void declareFree(const Eigen::Vector3d& centre, double radius);
    /// What the pixels without a match show. With exact depth: nothing up to the far limit,
    /// proven, but only where the part of the ray before the near limit, where surface has no match
    /// either, is within the clearance or in voxels proven free: by declareFreeOutside(), or by
    /// earlier views that had the whole voxel in their image, measured at every pixel. With
    /// `backgroundIsFree` the others show nothing either, but for those beside surface that is too
    /// near to be matched: with exact depth up to the far limit, else as far as both cameras see,
    /// for so far a pair of cameras matches what is there, and not in a hole as narrow as a strip
    /// that one camera alone sees.
    EmptyPixels emptyPixels(const View& view, const SensorModel& sensor,
                            bool backgroundIsFree) const;
    /// What a view saw through. Pixels that are proven empty count as measured; other empty ones
    /// make voxels known (no surface to look for there), but not free to fly through: a surface
    /// nearer than the range has no match either.
    void carve(const View& view, const SensorModel& sensor, const EmptyPixels& empty);
    /// Marks the voxels of these points as surface, and no others.
    void setSurface(const std::vector<Eigen::Vector3d>& points);
    /// A piece of surface more, or one less that was added before: a voxel is surface while it
    /// holds any. O(1).
    void addSurface(const Eigen::Vector3d& point);
    void removeSurface(const Eigen::Vector3d& point);

    State at(const Eigen::Vector3d& point) const;
    /// Part of a ray in unknown space.
    struct UnknownRun {
        double begin = -1;  ///< distance of the first unknown voxel [m]; negative: there is none
        double end = -1;    ///< where known space begins again, or the ray ends [m]
    };
    /// The unknown space that a ray meets first through free space, before `length` [m]. The
    /// direction is a unit vector.
    UnknownRun firstUnknown(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                            double length) const;
    /// An unknown voxel beside free space: surface may be there, or behind it.
    struct Frontier {
        Eigen::Vector3f centre;
        Eigen::Vector3f area;  ///< of its faces towards free space, as a vector out of it [m^2]
    };
    /// All of them whose centre is in the box, but those looked at in vain; in a fixed order.
    std::vector<Frontier> frontier(const Eigen::AlignedBox3d& within) const;
    /// Notes that a view was taken to see this place, unless it is free or surface now; places that
    /// are unknown still after `kTries` views do not count as unknown any more.
    void noteTry(const Eigen::Vector3d& point);
    static constexpr std::uint8_t kTries = 2;
    /// Notes whether a view that looked into the unknown from this place on had a match there.
    void noteLook(const Eigen::Vector3d& place, bool matched);
    /// What a look into the unknown from this place on is worth by those around it before (a cube
    /// of 4 voxels along each edge): the share that had a match over the usual one of 0.6, in
    /// (0, 1]; 1 before the first. Plain walls and the sky do not match, from wherever they are
    /// looked at.
    double lookWorth(const Eigen::Vector3d& place) const;

    /// Finds the voxels at whose centres a ball of radius `clearance` fits inside `limits`, with
    /// what the way between two of them needs. To be called again after changes; that costs in
    /// proportion to them, and little for the grid.
    void updateClear(double clearance, const Eigen::AlignedBox3d& limits);
    /// After updateClear(): which of those can be reached from `start`, straight from voxel centre
    /// to voxel centre, and how far that is. The start's own voxel counts as clear. `fits`, if
    /// given: asked of the centres of voxels that are free but too near to others for
    /// updateClear(); it answers for the straight ways to the voxels around, too. Answers are kept
    /// until forget() or until a voxel nearby becomes free: a "no" may live a little too long.
    /// Returns how many of the voxels reached are clear.
    std::size_t updateReach(const Eigen::Vector3d& start, const Fits& fits = {});
    /// The surface within this box changed: `fits` is to be asked again there.
    void forget(const Eigen::AlignedBox3d& changed);
    /// `fits` is to be asked again everywhere.
    void forgetAll() { fits_.clear(); }
    /// Voxels that are clear after updateClear(), whether or not a way leads there.
    std::size_t clearCount() const { return clearCount_; }
    bool isClear(const Eigen::Vector3d& point) const {
        const Eigen::Vector3i v = voxelOf(point);
        return inside(v) && clear_[index(v)] != 0;
    }
    /// True if all that lies nearer than `radius` to this place was seen through, or is surface
    /// or cut by surface: then only the surface that is known has to be kept away from. A voxel is
    /// cut that is known and shares a face with one of surface, or with `corners` one before a
    /// measured surface that shares a face, an edge or a corner.
    bool knownAround(const Eigen::Vector3d& point, double radius, bool corners) const;
    /// Centres of the voxels nearer than `radius` to the straight segment that are not known to be
    /// free; empty if there are none, or if surface is among them or one looked at in vain.
    std::vector<Eigen::Vector3d> toBeLookedAt(const Eigen::Vector3d& from,
                                              const Eigen::Vector3d& to, double radius) const;
    /// Centre of the nearest voxel, at most `reach` voxels away along each axis, that is clear (or
    /// with `reached` can be reached as well); nothing if there is none.
    std::optional<Eigen::Vector3d> nearestClear(const Eigen::Vector3d& point, int reach,
                                                bool reached) const;
    /// Length of the way to the voxel of this place [m]; infinite if it is not reachable.
    double distanceTo(const Eigen::Vector3d& point) const;
    /// Centre of the voxel that holds this place.
    Eigen::Vector3d snap(const Eigen::Vector3d& point) const;
    /// The way from the start of the last updateReach() to the voxel of `goal`, with needless
    /// corners cut; start first. Empty if it is not reachable.
    std::vector<Eigen::Vector3d> pathTo(const Eigen::Vector3d& goal) const;
    /// True if the straight segment stays in voxels that have the clearance.
    bool segmentClear(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const;
    /// Centres of all reachable voxels, every `stride`-th along each axis.
    std::vector<Eigen::Vector3d> reachable(int stride) const;

 private:
    static constexpr std::uint8_t kFreeBit = 1;   ///< seen through
    static constexpr std::uint8_t kKnownBit = 2;  ///< its centre was seen through, or is no place
                                                  ///< to look for surface; not enough to fly there
    static constexpr std::uint8_t kSurfaceBit = 4;
    static constexpr std::uint8_t kSeenBit = 8;  ///< the line of sight goes on behind its centre
    /// No part of it was left out: declared free, or free by a view that has all of it in its image
    /// and measured at every pixel.
    static constexpr std::uint8_t kProvenBit = 16;
    static constexpr std::uint8_t kMiddleBit = 32;  ///< known by what was measured at its centre
    static constexpr std::uint8_t kNoStep = kCubeOfVoxels / 2;
    static constexpr int kTryShift = 6;  ///< count of vain tries in the upper bits

    bool inside(const Eigen::Vector3i& v) const {
        return (v.array() >= 0).all() && (v.array() < size_.array()).all();
    }
    std::size_t index(const Eigen::Vector3i& v) const {
        return (static_cast<std::size_t>(v.z()) * static_cast<std::size_t>(size_.y()) +
                static_cast<std::size_t>(v.y())) *
                   static_cast<std::size_t>(size_.x()) +
               static_cast<std::size_t>(v.x());
    }
    Eigen::Vector3i coordinates(std::size_t index) const;
    Eigen::Vector3i voxelOf(const Eigen::Vector3d& point) const {
        return wholesBelow((point - origin_) / voxel_);
    }
    Eigen::Vector3d centre(const Eigen::Vector3i& v) const {
        return origin_ + (v.cast<double>() + Eigen::Vector3d::Constant(0.5)) * voxel_;
    }
    bool passable(std::uint8_t voxel) const {
        return (voxel & kFreeBit) != 0 && (voxel & kSurfaceBit) == 0;
    }
    /// Something not known to be free, beside what is.
    bool blocks(std::size_t voxel) const;
    /// Of pixels without a match: true if nothing lies nearer than the near limit, by `sensor`'s
    /// clearance and by what was proven before.
    bool nothingTooNear(const View& view, const SensorModel& sensor, int column, int row) const;
    /// The same for a rectangle of pixels at once, both corners (column, row) included; false may
    /// be said where each of them by itself is clear.
    bool nothingTooNear(const View& view, const SensorModel& sensor, const Eigen::Vector2i& first,
                        const Eigen::Vector2i& last) const;
    void searchFrom(const Eigen::Vector3i& start, const Fits& fits);
    bool fitsAt(std::size_t voxel, const Fits& fits);

    Eigen::AlignedBox3d box_;
    double voxel_;
    Eigen::Vector3d origin_;
    Eigen::Vector3i size_;
    std::vector<std::uint8_t> voxels_;
    std::vector<std::uint16_t> pieces_;  ///< of surface in each voxel
    struct Looks {
        std::uint32_t all = 0, matched = 0;
    };
    static constexpr int kRegion = 4;  ///< voxels along each edge of what looks are counted in
    std::size_t regionOf(const Eigen::Vector3i& v) const;
    std::vector<Looks> looks_;  ///< by region; empty before the first
    /// What updateClear() found the last time: voxels that were passable, those that blocked
    /// others, and how many of those are too near to each.
    std::vector<std::uint8_t> passable_, blocking_;
    std::vector<std::uint32_t> blockers_;
    std::vector<std::uint8_t> allowed_;  ///< 1 = inside the limits of updateClear()
    double clearance_ = -1;              ///< of updateClear()
    Eigen::AlignedBox3d limits_;
    std::vector<std::uint8_t> clear_;  ///< 1 = the ball fits here
    std::size_t clearCount_ = 0;
    std::vector<std::uint8_t> fits_;  ///< answers of `fits`: 0 not asked, 1 no, 2 yes
    std::vector<float> distance_;     ///< from the start [m]
    /// Of the way to each voxel the last step, an index of aroundVoxel(); kNoStep at the start and
    /// where no way leads.
    std::vector<std::uint8_t> step_;
    Eigen::Vector3d start_ = Eigen::Vector3d::Zero();
};

}  // namespace riftmap
