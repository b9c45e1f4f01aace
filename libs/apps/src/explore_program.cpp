// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/explore_program.h"

#include <cstdio>

#include "explore_record.h"
#include "explore_run.h"
#include "riftmap/apps/interrupt.h"
#include "riftmap/core/file.h"

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
                     {"octomap_frontier", Planner::kOctomapFrontier},
                     {"foresight", Planner::kForesight}},
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
               "go on with the interrupted run there, with its own configuration if none is given");
}

std::filesystem::path ExploreProgram::defaultConfiguration() const {
    return resume_.empty() ? resume_ : RunDirectory::resume(resume_).file("config_used.ini");
}

RunDirectory ExploreProgram::freshDirectory() {
    std::vector<std::filesystem::path> inputs;
    if (!simulation_.world.mesh.empty()) {
        inputs.emplace_back(simulation_.world.mesh);
    }
    return makeRunDirectory(inputs);
}

void ExploreProgram::run() {
    planner_.seed = seed();
    if (resume_.empty()) {
        RunDirectory directory = freshDirectory();
        explore(directory);
        return;
    }
    RunDirectory directory = RunDirectory::resume(resume_);
    const std::string config = table().dump();
    checkSameConfiguration(directory, config);
    if (const auto reason = howItEnded(directory, config)) {
        stopReason = *reason;
        std::printf("%s: has ended (%s), there is nothing to go on with\n",
                    directory.path().c_str(), reason->c_str());
        return;
    }
    explore(directory);
}

void ExploreProgram::explore(RunDirectory& directory) {
    ExploreRun run(*this, directory, !resume_.empty());
    const InterruptGuard interrupt;
    run.run(interrupt.requested());
}

}  // namespace riftmap
