// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "riftmap/apps/program.h"
#include "riftmap/eval/baselines.h"
#include "riftmap/eval/coverage.h"
#include "riftmap/eval/eval_options.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/paper_planner.h"
#include "riftmap/planner/surface_explorer.h"
#include "riftmap/sim/simulated_platform.h"
#include "riftmap/stereo/stereo_options.h"

namespace riftmap {

/// Section [Explore].
struct ExploreOptions {
    enum class Planner {
        kRiftmap,
        kPaper,
        kRandom,
        kOrbit,
        kLawnmower,
        kSphere,
        kOctomapFrontier,
        kForesight
    };

    Planner planner = Planner::kRiftmap;
    bool knownBox = false;  ///< the planner is told the box of an object that stands alone
    bool judge = true;      ///< coverage after every view
    bool rawlog = true;     ///< keep what the camera saw
    int pictureEvery = 0;   ///< [views]; 0 = only at the end
    void describe(OptionTable& table);
};

/// riftmap-explore: a simulated world, explored until nothing is left to see.
class ExploreProgram : public Program {
 public:
    ExploreProgram();

    /// Ctrl-C ends it after the view at work, with everything saved. With --resume it goes on in
    /// the directory of an interrupted run.
    void run() override;

    // What came out of it.
    std::string stopReason;
    std::size_t views = 0;
    double pathLength = 0;  ///< [m]
    int collisions = 0;
    CoverageReport coverage;  ///< of the final map; empty without a judge

 protected:
    void describe(OptionTable& table) override;
    void arguments(CommandLine& line) override;
    std::filesystem::path defaultConfiguration() const override;

 private:
    friend class ExploreRun;

    RunDirectory freshDirectory();
    void explore(RunDirectory& directory);

    SimulationOptions simulation_;
    StereoOptions stereo_;
    GraphOptions graph_;
    PlannerOptions planner_;
    PaperPlannerOptions paper_;
    BaselineOptions baseline_;
    StopOptions stop_;
    EvalOptions eval_;
    ExploreOptions explore_;
    std::filesystem::path resume_;
};

}  // namespace riftmap
