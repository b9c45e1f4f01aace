// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>

#include "riftmap/planner/paper_planner.h"
#include "riftmap/planner/view_planner.h"

namespace riftmap {

/// The paper's planner in the loop: to the dominant rift along its path over the graph, with a view
/// at each pose of it. The paper takes every pose as reachable (sec. X.B leaves the rest to future
/// work); here a pose is left out where no free way to it is known. If that leaves none, the
/// dominant rift is looked at from the reachable place nearest to the pose in front of it. The run
/// ends when no rift is left ("complete"), or when that view was the last one, too
/// ("no_reachable_pose").
class PaperViewPlanner : public ViewPlanner {
 public:
    explicit PaperViewPlanner(const PaperPlannerOptions& options) : options_(options) {}

    std::string name() const override { return "paper"; }
    std::optional<ViewPlan> next(Knowledge& knowledge) override;
    std::string whyNone() const override { return whyNone_; }

 private:
    std::optional<ViewPlan> nextOfQueue(const Knowledge& knowledge);
    std::optional<ViewPlan> asNearAsPossible(const Pose& wanted, const Eigen::Vector3d& target,
                                             const Knowledge& knowledge);

    PaperPlannerOptions options_;
    GraphSearch search_;
    std::deque<Pose> queue_;          ///< poses of the present path that are still to come
    std::optional<Pose> substitute_;  ///< the last view that stood for a pose out of reach
    std::string whyNone_ = "complete";
};

}  // namespace riftmap
