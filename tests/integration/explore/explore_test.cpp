// SPDX-License-Identifier: BSD-3-Clause
// riftmap-explore as its user runs it, on a small camera.
#include <gtest/gtest.h>

#include <map>

#include "riftmap/apps/build_program.h"
#include "riftmap/apps/explore_program.h"
#include "riftmap/core/csv.h"
#include "riftmap/core/file.h"
#include "temporary_folder.h"

namespace riftmap {
namespace {

using test::TemporaryFolder;
using Arguments = std::vector<std::string>;

const std::string kConfig = std::string(RIFTMAP_SOURCE_DIR) + "/config/";
const Arguments kSmallCamera = {"--set",        "Camera.width=160",
                                "--set",        "Camera.height=120",
                                "--set",        "Camera.f=130",
                                "--set",        "Camera.num_disparities=32",
                                "--set",        "Stereo.num_disparities=32",
                                "--no-progress"};

Arguments operator+(Arguments a, const Arguments& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

Arguments roomRun(const std::filesystem::path& out, const std::string& noise, int views) {
    return Arguments{kConfig + "explore-room.ini",
                     "--set",
                     "Graph.target_resolution=0.05",
                     "--set",
                     "Noise.level=" + noise,
                     "--set",
                     "Stop.max_views=" + std::to_string(views),
                     "--set",
                     "Explore.judge=false",
                     "--out",
                     out.string()} +
           kSmallCamera;
}

int explore(const Arguments& arguments) {
    ExploreProgram program;
    return runProgram(program, arguments);
}

/// A ground robot refuses every pose whose horizon is not level or whose tilt it does not have,
/// also between the views.
TEST(Explore, aGroundRobotFindsItsWay) {
    const TemporaryFolder folder;
    const auto run = folder / "run";
    ASSERT_EQ(explore(Arguments{kConfig + "explore-courtyard.ini", "--set", "Noise.level=N0",
                                "--set", "Stop.max_views=12", "--set", "Explore.judge=false",
                                "--set", "Explore.rawlog=false", "--out", run.string()} +
                      kSmallCamera),
              0);
    EXPECT_EQ(readCsv(run / "steps.csv").rows.size(), 12U);
}

TEST(Explore, fillsItsRunDirectory) {
    const TemporaryFolder folder;
    const auto run = folder / "run";
    ASSERT_EQ(explore(roomRun(run, "N0", 4)), 0);
    for (const auto* name :
         {"graph.ply", "map.pixelgraph", "scene.3Dscene", "trajectory.tum", "steps.csv",
          "rifts.csv", "rift_cells.csv", "summary.yaml", "config_used.ini", "manifest.yaml",
          "run.rawlog", "report.html", "map.png"}) {
        EXPECT_TRUE(std::filesystem::exists(run / name)) << name;
    }
    EXPECT_EQ(readCsv(run / "steps.csv").rows.size(), 4U);
    const std::string page = readFile(run / "report.html");
    EXPECT_EQ(page.find("http://"), std::string::npos);
    EXPECT_EQ(page.find("https://"), std::string::npos);
}

/// Every cell that is left is in the rift of its number, in the same state.
TEST(Explore, theCertificateHasARowForEachConnectedRift) {
    const TemporaryFolder folder;
    const auto run = folder / "run";
    ASSERT_EQ(explore(roomRun(run, "N0", 4)), 0);
    const CsvTable rifts = readCsv(run / "rifts.csv");
    const CsvTable cells = readCsv(run / "rift_cells.csv");
    EXPECT_EQ(
        rifts.header,
        (std::vector<std::string>{
            "id",    "state",     "reason", "type",          "x",         "y",        "z",
            "nx",    "ny",        "nz",     "open_vertices", "edges",     "attempts", "extent_m",
            "rim_m", "coarse_m2", "cells",  "first_view",    "last_view", "parents",  "joined"}));
    std::map<std::string, std::size_t> cellsOf;
    std::map<std::string, std::string> stateOf;
    std::size_t deferred = 0;
    for (const auto& row : cells.rows) {
        const std::string& rift = row[cells.column("rift")];
        const std::string& state = row[cells.column("state")];
        ++cellsOf[rift];
        EXPECT_EQ(stateOf.try_emplace(rift, state).first->second, state);
        EXPECT_NE(state, "open");  // the run is over
        deferred += state == "deferred" ? 1 : 0;
    }
    EXPECT_GT(deferred, 10U);
    std::map<std::string, int> counts;
    std::size_t left = 0;
    for (const auto& row : rifts.rows) {
        const std::string& state = row[rifts.column("state")];
        ++counts[state];
        EXPECT_LE(std::stoul(row[rifts.column("first_view")]),
                  std::stoul(row[rifts.column("last_view")]));
        EXPECT_GT(std::stod(row[rifts.column("extent_m")]), 0.0);
        if (state != "resolved") {
            ++left;
            EXPECT_EQ(std::to_string(cellsOf[row[rifts.column("id")]]), row[rifts.column("cells")]);
            EXPECT_EQ(stateOf[row[rifts.column("id")]], state);
            EXPECT_EQ(row[rifts.column("last_view")], "3");
        }
    }
    EXPECT_EQ(left, stateOf.size());
    const std::string summary = readFile(run / "summary.yaml");
    for (const auto& [state, n] : counts) {
        EXPECT_NE(summary.find("rifts_" + state + ": " + std::to_string(n) + "\n"),
                  std::string::npos)
            << state;
    }
}

class ExploreNoise : public testing::TestWithParam<std::string> {};

TEST_P(ExploreNoise, whatItRecordedBuildsTheSameMap) {
    const TemporaryFolder folder;
    ASSERT_EQ(explore(roomRun(folder / "run", GetParam(), 4)), 0);
    BuildProgram build;
    ASSERT_EQ(runProgram(build, {(folder / "run" / "config_build.ini").string(),
                                 (folder / "run" / "run.rawlog").string(), "--out",
                                 (folder / "built").string(), "--no-progress"}),
              0);
    EXPECT_EQ(readFile(folder / "run" / "graph.ply"), readFile(folder / "built" / "graph.ply"));
}

INSTANTIATE_TEST_SUITE_P(Levels, ExploreNoise, testing::Values("N0", "N3", "N4"));

TEST(Explore, theNumberOfThreadsChangesNoByte) {
    const TemporaryFolder folder;
    for (const std::string threads : {"1", "2"}) {
        ASSERT_EQ(explore(roomRun(folder / threads, "N3", 6) + Arguments{"--threads", threads}), 0);
    }
    for (const auto* name : {"graph.ply", "trajectory.tum", "rifts.csv", "rift_cells.csv"}) {
        EXPECT_EQ(readFile(folder / "1" / name), readFile(folder / "2" / name)) << name;
    }
}

TEST(Explore, aResumedRunEndsAsIfItHadNotBeenInterrupted) {
    const TemporaryFolder folder;
    ASSERT_EQ(explore(roomRun(folder / "whole", "N0", 5)), 0);
    // Interrupted after two views; the configuration there asks for five.
    ASSERT_EQ(explore(roomRun(folder / "cut", "N0", 5) + Arguments{"--set", "Stop.max_seconds=0"}),
              0);
    EXPECT_LT(readCsv(folder / "cut" / "steps.csv").rows.size(), 5U);
    ASSERT_EQ(explore(Arguments{(folder / "cut" / "config_used.ini").string(), "--resume",
                                (folder / "cut").string(), "--set", "Stop.max_seconds=1e6",
                                "--no-progress"}),
              0);
    for (const auto* name : {"graph.ply", "trajectory.tum", "rifts.csv", "rift_cells.csv"}) {
        EXPECT_EQ(readFile(folder / "whole" / name), readFile(folder / "cut" / name)) << name;
    }
}

/// An object on its own, known to stand in a box: ends by itself and covers what can be seen.
TEST(Explore, endsByItselfWithAnObjectCovered) {
    const TemporaryFolder folder;
    ExploreProgram program;
    const int code =
        runProgram(program, Arguments{kConfig + "explore-sculpture.ini", "--set", "Noise.level=N0",
                                      "--set", "Graph.target_resolution=0.04", "--set",
                                      "Graph.gamma=0.01", "--set", "Eval.deltas=0.04", "--set",
                                      "Eval.headline=0.04", "--set", "Eval.samples=2000", "--set",
                                      "Explore.rawlog=false", "--out", (folder / "run").string()} +
                                kSmallCamera);
    ASSERT_EQ(code, 0);
    EXPECT_EQ(program.stopReason, "complete");
    EXPECT_EQ(program.collisions, 0);
    EXPECT_LE(program.views, 60U);
    EXPECT_GE(program.coverage.at.front().cObs, 0.95);
    EXPECT_GE(program.coverage.at.front().accuracy, 0.99);
}

}  // namespace
}  // namespace riftmap
