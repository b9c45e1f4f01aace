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
/// at each pose of it. The paper takes every pose as reachable; here a pose is left out where no
/// free way to it is known. The run ends when no rift is left or no pose of the
/// plan can be taken.
class PaperViewPlanner : public ViewPlanner {
 public:
    explicit PaperViewPlanner(const PaperPlannerOptions& options) : options_(options) {}

    std::string name() const override { return "paper"; }
    std::optional<ViewPlan> next(Knowledge& knowledge) override;

 private:
    std::optional<ViewPlan> nextOfQueue(const Knowledge& knowledge);

    PaperPlannerOptions options_;
    GraphSearch search_;
    std::deque<Pose> queue_;  ///< poses of the present path that are still to come
};

}  // namespace riftmap
