// SPDX-License-Identifier: BSD-3-Clause
// What the planner of an object that stands alone learns from the views it took.
#pragma once

#include <Eigen/Core>

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

/// What the planner of an object keeps from plan to plan.
struct ObjectMemory {
    /// Of unseen surface, of tears, and of surface that is better known, which moves into its place
    /// and so fills new cubes, too. Tears are promised with care and may bring more.
    PromiseKept frontier{1.0}, tears{2.5}, doubt{1.0};
    double frontierGain = 0, tearGain = 0, doubtGain = 0;  ///< expected of the last view [m^2]
    Eigen::Vector3d target = Eigen::Vector3d::Zero();      ///< where it was to be taken
    /// Holds the promises of the last view against the new area that it brought, to be called once
    /// after each SurfaceSummary::update(). New area counts for frontier and tears in proportion
    /// to their promises; what goes beyond those counts for surface better known. `minGain`:
    /// what makes a view worth it [m^2], >= 0.
    void update(const SurfaceSummary& summary, double minGain);
};

}  // namespace riftmap
