// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/paper_view_planner.h"

namespace riftmap {

std::optional<ViewPlan> PaperViewPlanner::nextOfQueue(const Knowledge& knowledge) {
    while (!queue_.empty()) {
        Pose pose = queue_.front();
        queue_.pop_front();
        const auto place = knowledge.placeAt(pose.translation);
        if (!place || !knowledge.tiltAllowed(pose)) {
            continue;
        }
        pose.translation = place->eye;
        ViewPlan plan;
        plan.path = knowledge.pathTo(pose);
        if (!plan.path.empty()) {
            return plan;
        }
    }
    return std::nullopt;
}

std::optional<ViewPlan> PaperViewPlanner::next(Knowledge& knowledge) {
    if (auto plan = nextOfQueue(knowledge)) {
        return plan;
    }
    const PaperPlan paper = planPaper(knowledge.graph(), knowledge.camera(), options_, search_);
    if (paper.dominant == PaperPlan::kNone) {
        return std::nullopt;
    }
    queue_.assign(paper.poses.begin(), paper.poses.end());
    return nextOfQueue(knowledge);
}

}  // namespace riftmap
