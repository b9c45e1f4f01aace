// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "riftmap/core/options.h"
#include "riftmap/core/platform.h"
#include "riftmap/core/view.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/rift_tracker.h"
#include "riftmap/planner/view_planner.h"

namespace riftmap {

/// Section [Stop]: when a run ends although something is left to see.
struct StopOptions {
    int maxViews = 1000;      ///< [views]
    double maxMetres = 1e6;   ///< of path [m]
    double maxSeconds = 1e6;  ///< of running [s]
    void describe(OptionTable& table);
};

/// What one view of the run was.
struct ExploreStep {
    std::size_t view = 0;         ///< from 0
    const View* input = nullptr;  ///< valid during the call
    MergeResult merged;
    std::size_t riftCount = 0;  ///< of the graph
    double gain = 0;            ///< that the plan expected [m^2] ...
    double coarseGain = 0;      ///< ... of it by knowing surface better
    double unknownGain = 0;     ///< ... of it by looking into unknown space
    double newArea = 0;         ///< that came true, see SurfaceSummary::newArea() [m^2]
    double wellKnownArea = 0;   ///< surface that is as fine and accurate as asked since [m^2]
    double pathLength = 0;      ///< so far [m]
    double grabMs = 0, stereoMs = 0, mergeMs = 0;
    double riftsMs = 0;      ///< finding the rifts and following them from the view before
    double knowledgeMs = 0;  ///< keeping the planner's picture of the map up to date
    double planMs = 0;       ///< choice of this view, with knowledgeMs of the view before
    double seconds = 0;      ///< since the start
};

/// The loop: grab, match, merge, find the rifts, plan, move; until no view is worth it any more.
/// Map frame. Not thread-safe.
class SurfaceExplorer {
 public:
    /// An observation as it comes from the platform becomes the one that is used (written to a
    /// file and rounded as there, for instance), and then the view that is merged.
    using Record = std::function<void(StereoObservation&)>;
    using Build = std::function<View(const StereoObservation&)>;
    using OnStep = std::function<void(const ExploreStep&, const Knowledge&)>;

    /// Everything must outlive the explorer. `record` and `onStep` may be empty.
    SurfaceExplorer(CameraPlatform& platform, PixelGraph& graph, ViewPlanner& planner,
                    const PlannerOptions& options, const StopOptions& stop, Build build,
                    Record record, OnStep onStep);

    /// Runs to the end; `interrupt` (e.g. set by a signal handler) ends it after the view at work.
    /// Throws CollisionError where the platform hits something; the map is complete up to there.
    /// @param secondsBefore of running that count, too: of the run that this one goes on with
    /// @param viewsBefore of that run: no limit ends this one before it has taken them again
    void run(const std::atomic<bool>& interrupt, double secondsBefore = 0,
             std::size_t viewsBefore = 0);

    /// The planner's reason ("complete", "no_reachable_pose"), "max_views", "max_metres",
    /// "max_seconds", "interrupted".
    const std::string& stopReason() const { return stopReason_; }
    const Knowledge& knowledge() const { return knowledge_; }
    /// The rifts as of the last view or, when the run is over, as they ended.
    const RiftTracker& rifts() const { return rifts_; }
    std::size_t views() const { return knowledge_.views(); }
    double pathLength() const { return pathLength_; }

 private:
    void look(const std::optional<ViewPlan>& plan, double planMs);
    std::optional<ViewPlan> choose(double& planMs);
    void move(ViewPlan& plan);
    bool limitReached(double seconds);

    CameraPlatform& platform_;
    PixelGraph& graph_;
    ViewPlanner& planner_;
    StopOptions stop_;
    Build build_;
    Record record_;
    OnStep onStep_;
    Knowledge knowledge_;
    RiftTracker rifts_;
    std::string stopReason_;
    double pathLength_ = 0;
    double lastKnowledgeMs_ = 0;
    std::function<double()> clock_;  ///< seconds since the start
};

}  // namespace riftmap
