// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/paper_view_planner.h"

#include <algorithm>
#include <vector>

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

/// Towards the target from the reachable place that is nearest to the pose wanted; not twice in a
/// row from the same place, for it shows nothing new.
std::optional<ViewPlan> PaperViewPlanner::asNearAsPossible(const Pose& wanted,
                                                           const Eigen::Vector3d& target,
                                                           const Knowledge& knowledge) {
    std::vector<Eigen::Vector3d> places = knowledge.space().reachable(1);
    places.push_back(knowledge.camera().translation);
    const auto nearest =
        std::min_element(places.begin(), places.end(), [&](const auto& a, const auto& b) {
            return (a - wanted.translation).squaredNorm() < (b - wanted.translation).squaredNorm();
        });
    const auto place = knowledge.placeAt(*nearest);
    if (!place || (target - place->eye).norm() < 1e-3) {
        return std::nullopt;
    }
    const Pose pose = lookAt(place->eye, target);
    constexpr double kSame = 1e-3;  // [m], and of the axes
    const bool again = substitute_ &&
                       (substitute_->translation - pose.translation).norm() < kSame &&
                       (substitute_->rotation - pose.rotation).norm() < kSame;
    if (again || !knowledge.tiltAllowed(pose)) {
        return std::nullopt;
    }
    ViewPlan plan;
    plan.path = place->path == 0.0 ? std::vector<Pose>{pose} : knowledge.pathTo(pose);
    if (plan.path.empty()) {
        return std::nullopt;
    }
    substitute_ = pose;
    return plan;
}

std::optional<ViewPlan> PaperViewPlanner::next(Knowledge& knowledge) {
    whyNone_ = "complete";
    if (auto plan = nextOfQueue(knowledge)) {
        return plan;
    }
    const PaperPlan paper = planPaper(knowledge.graph(), knowledge.camera(), options_, search_);
    if (paper.dominant == PaperPlan::kNone) {
        return std::nullopt;
    }
    queue_.assign(paper.poses.begin(), paper.poses.end());
    if (auto plan = nextOfQueue(knowledge)) {
        return plan;
    }
    whyNone_ = "no_reachable_pose";
    const auto& rift = knowledge.graph().rifts()[paper.dominant];
    return paper.poses.empty()
               ? std::nullopt
               : asNearAsPossible(paper.poses.back(), rift.centre.cast<double>(), knowledge);
}

}  // namespace riftmap
