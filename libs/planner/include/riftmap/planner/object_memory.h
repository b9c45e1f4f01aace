// SPDX-License-Identifier: BSD-3-Clause
// What the planner of an object that stands alone learns from the views it took.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <vector>

#include "riftmap/planner/surface_summary.h"

namespace riftmap {

/// What came of one kind of gain that views of an object promised.
class PromiseKept {
 public:
    /// `most`: greatest share.
    explicit PromiseKept(double most) : most_(most) {}
    /// A view promised this much more surface and brought so much [m^2]; promises below a
    /// quarter of `least` say nothing, smaller sums than it little.
    void note(double promised, double came, double least);
    /// Part of a promise that comes true, going by the last few; 1 before the first.
    double share() const { return share_; }

 private:
    double most_;
    double promised_ = 0, came_ = 0;
    double share_ = 1;
};

/// Where views looked for surface behind the frontier and found little: what lies on beyond, often
/// the inside of a hollow body, is worth less than a frontier that no view has looked at. Kept by
/// cubes of eight voxels of the frontier from the map's origin on, for the whole run. `edge`: of
/// those voxels [m], > 0, the same in every call.
class LookedInVain {
 public:
    /// A view of these places brought this share (>= 0) of what it promised. If that is less than
    /// half, each cube with a place in it is left with that share of its worth, but 0.3 at least.
    void note(const std::vector<Eigen::Vector3d>& places, double kept, double edge);
    /// Share of its worth that is left to the frontier at a place, 0 to 1.
    double left(const Eigen::Vector3d& place, double edge) const;

 private:
    static std::array<int, 3> cubeOf(const Eigen::Vector3d& place, double edge);

    std::map<std::array<int, 3>, double> left_;  ///< by cube; 1 where there is none
};

/// What the planner of an object keeps from plan to plan.
struct ObjectMemory {
    /// Of unseen surface, of tears, and of surface that is better known, which moves into its place
    /// and so fills new cubes, too. Tears are promised with care and may bring more.
    PromiseKept frontier{1.0}, tears{2.5}, doubt{1.0};
    double frontierGain = 0, tearGain = 0, doubtGain = 0;  ///< expected of the last view [m^2]
    std::vector<Eigen::Vector3d> looked;  ///< places of the frontier that it was to look at
    Eigen::Vector3d target = Eigen::Vector3d::Zero();  ///< where it was to be taken
    LookedInVain lookedInVain;
    /// Holds the promises of the last view against the new area that it brought, to be called once
    /// after each SurfaceSummary::update(). New area counts for frontier and tears in proportion
    /// to their promises; what goes beyond those counts for surface better known. Where
    /// the frontier promised at least half of the new surface, its places are noted if that failed
    /// to come. `minGain`: share of the summary's area that makes a view worth it, >= 0; `edge`: of
    /// the frontier's voxels [m].
    void update(const SurfaceSummary& summary, double minGain, double edge);
};

}  // namespace riftmap
