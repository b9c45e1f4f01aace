// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/surface_explorer.h"

#include <chrono>
#include <utility>

namespace riftmap {

namespace {

using Clock = std::chrono::steady_clock;

double msSince(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace

void StopOptions::describe(OptionTable& table) {
    table.section("Stop", "When a run ends although something is left to see");
    table.add("max_views", maxViews, 1, 1000000, "", "Views taken at most");
    table.add("max_metres", maxMetres, 0, 1e9, "m", "Longest path");
    table.add("max_seconds", maxSeconds, 0, 1e9, "s", "Longest time of running");
}

SurfaceExplorer::SurfaceExplorer(CameraPlatform& platform, PixelGraph& graph, ViewPlanner& planner,
                                 const PlannerOptions& options, const StopOptions& stop,
                                 Build build, Record record, OnStep onStep)
    : platform_(platform),
      graph_(graph),
      planner_(planner),
      stop_(stop),
      build_(std::move(build)),
      record_(std::move(record)),
      onStep_(std::move(onStep)),
      knowledge_(graph, platform.limits(), options),
      rifts_(knowledge_.summary().cellSize()) {}

bool SurfaceExplorer::limitReached(double seconds) {
    if (knowledge_.views() >= static_cast<std::size_t>(stop_.maxViews)) {
        stopReason_ = "max_views";
    } else if (pathLength_ >= stop_.maxMetres) {
        stopReason_ = "max_metres";
    } else if (seconds >= stop_.maxSeconds) {
        stopReason_ = "max_seconds";
    }
    return !stopReason_.empty();
}

/// Takes the view where the camera is and draws the consequences.
void SurfaceExplorer::look(const std::optional<ViewPlan>& plan, double planMs) {
    ExploreStep step;
    step.view = knowledge_.views();
    step.planMs = planMs;
    auto t = Clock::now();
    StereoObservation observation = platform_.grab();
    if (record_) {
        record_(observation);
    }
    step.grabMs = msSince(t);

    t = Clock::now();
    const View view = build_(observation);
    step.stereoMs = msSince(t);

    t = Clock::now();
    step.merged = graph_.merge(view);
    step.mergeMs = msSince(t);

    t = Clock::now();
    step.riftCount = graph_.rifts().size();
    step.riftsMs = msSince(t);

    t = Clock::now();
    std::vector<TriedTear> tried;
    if (plan) {
        tried = knowledge_.ledger().tears(plan->cells, knowledge_.summary().cellSize());
    }
    const SurfaceSummary& summary = knowledge_.summary();
    const double areaBefore = summary.area();
    const double coarseBefore = summary.coarseArea();
    knowledge_.update(view);
    step.newArea = summary.newArea();
    step.wellKnownArea = summary.area() - areaBefore - (summary.coarseArea() - coarseBefore);
    if (plan) {
        knowledge_.ledger().judge(knowledge_.summary(), tried, view.world_T_camera.translation);
        knowledge_.noteLooks(view, plan->unknown);
        step.gain = plan->gain;
        step.coarseGain = plan->coarseGain;
        step.unknownGain = plan->unknownGain;
    }
    step.knowledgeMs = msSince(t);
    lastKnowledgeMs_ = step.knowledgeMs;
    t = Clock::now();
    rifts_.update(step.view, knowledge_.ledger().takeChanged(),
                  plan ? plan->cells : std::vector<std::uint64_t>());
    step.riftsMs += msSince(t);
    step.input = &view;
    step.pathLength = pathLength_;
    step.seconds = clock_();
    if (onStep_) {
        onStep_(step, knowledge_);
    }
}

std::optional<ViewPlan> SurfaceExplorer::choose(double& planMs) {
    const auto t = Clock::now();
    knowledge_.updateReach();
    auto plan = planner_.next(knowledge_);
    planMs = msSince(t) + lastKnowledgeMs_;
    return plan;
}

/// Moves along the plan's path, at most as far as one step may go.
void SurfaceExplorer::move(ViewPlan& plan) {
    const double maxStep = platform_.limits().maxStep;
    std::vector<Pose> path;
    Eigen::Vector3d at = platform_.pose().translation;
    double length = 0;
    for (const Pose& pose : plan.path) {
        const double leg = (pose.translation - at).norm();
        if (length + leg > maxStep) {
            // As far as it goes; the view from there is taken, and the next plan goes on.
            Pose last = plan.path.back();
            last.translation = at + (pose.translation - at) * ((maxStep - length) / leg);
            path.push_back(last);
            length = maxStep;
            plan.cells.clear();
            plan.unknown.clear();
            break;
        }
        length += leg;
        path.push_back(pose);
        at = pose.translation;
    }
    platform_.moveAlong(path);
    pathLength_ += length;
}

void SurfaceExplorer::run(const std::atomic<bool>& interrupt, double secondsBefore,
                          std::size_t viewsBefore) {
    const auto start = Clock::now();
    clock_ = [=] { return secondsBefore + msSince(start) / 1000.0; };
    look(std::nullopt, 0.0);
    while (views() < viewsBefore || !limitReached(clock_())) {
        if (interrupt) {
            stopReason_ = "interrupted";
            break;
        }
        double planMs = 0;
        std::optional<ViewPlan> plan = choose(planMs);
        if (!plan) {
            stopReason_ = planner_.whyNone();
            break;
        }
        move(*plan);
        look(plan, planMs);
    }
    if (stopReason_ != "complete") {
        knowledge_.ledger().deferOpen(stopReason_);
    }
    rifts_.update(views() - 1, knowledge_.ledger().takeChanged(), {});
}

}  // namespace riftmap
