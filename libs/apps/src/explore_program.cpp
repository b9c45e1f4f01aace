// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/explore_program.h"

#include "explore_run.h"
#include "riftmap/apps/interrupt.h"

namespace riftmap {

void ExploreOptions::describe(OptionTable& table) {
    table.section("Explore", "The run");
    table.addChoice("planner", planner,
                    {{"riftmap", Planner::kRiftmap},
                     {"paper", Planner::kPaper},
                     {"random", Planner::kRandom},
                     {"orbit", Planner::kOrbit},
                     {"lawnmower", Planner::kLawnmower},
                     {"sphere", Planner::kSphere},
                     {"octomap_frontier", Planner::kOctomapFrontier}},
                    "Who chooses the views");
    table.add("known_box", knownBox,
              "Tell the planner the box that holds all surfaces: an object that stands alone, with "
              "free space around it");
    table.add("judge", judge, "Coverage against the world's surface after every view");
    table.add("rawlog", rawlog, "Keep what the camera saw in run.rawlog");
    table.add("picture_every", pictureEvery, 0, 1000000, "",
              "A picture of the map every so many views; 0 = only at the end");
}

ExploreProgram::ExploreProgram()
    : Program("riftmap-explore", "Explores a world until its whole surface is in the map",
              Config::kRequired) {}

void ExploreProgram::describe(OptionTable& table) {
    explore_.describe(table);
    simulation_.describe(table);
    stereo_.describe(table);
    graph_.describe(table);
    planner_.describe(table);
    paper_.describe(table);
    baseline_.describe(table);
    stop_.describe(table);
    eval_.describe(table);
}

void ExploreProgram::arguments(CommandLine& line) {
    line.value("resume", 0, "DIR", resume_,
               "Go on with an interrupted run there (same configuration)");
}

void ExploreProgram::run() {
    RunInfo info;
    info.program = name();
    info.command = commandText();
    info.config = table().dump();
    info.seed = seed();
    info.threads = threads();
    if (!simulation_.world.mesh.empty()) {
        info.inputs.emplace_back(simulation_.world.mesh);
    }
    planner_.seed = seed();
    RunDirectory directory(resume_.empty() ? requiredOut() : resume_, info,
                           overwrite() || !resume_.empty());
    ExploreRun run(*this, directory);
    const InterruptGuard interrupt;
    run.run(interrupt.requested());
}

}  // namespace riftmap
