// SPDX-License-Identifier: BSD-3-Clause
// riftmap-explore as its user runs it, on a small camera.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "riftmap/apps/build_program.h"
#include "riftmap/apps/eval_program.h"
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
          "rifts.csv", "rift_cells.csv", "gains.csv", "summary.yaml", "config_used.ini",
          "manifest.yaml", "run.rawlog", "report.html", "map.png"}) {
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
    for (const auto* name :
         {"graph.ply", "trajectory.tum", "rifts.csv", "rift_cells.csv", "gains.csv"}) {
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
    for (const auto* name :
         {"graph.ply", "trajectory.tum", "rifts.csv", "rift_cells.csv", "gains.csv"}) {
        EXPECT_EQ(readFile(folder / "whole" / name), readFile(folder / "cut" / name)) << name;
    }
}

/// Runs that were killed, and runs that go on with them.
class ExploreResumed : public testing::Test {
 protected:
    static Arguments sculpture(const std::filesystem::path& out, const std::string& noise,
                               int views, const std::string& judge = "true") {
        return Arguments{kConfig + "explore-sculpture.ini",
                         "--set",
                         "Noise.level=" + noise,
                         "--set",
                         "Graph.target_resolution=0.04",
                         "--set",
                         "Graph.gamma=0.01",
                         "--set",
                         "Eval.deltas=0.02 0.04",
                         "--set",
                         "Eval.headline=0.04",
                         "--set",
                         "Eval.samples=2000",
                         "--set",
                         "Explore.picture_every=2",
                         "--set",
                         "Explore.judge=" + judge,
                         "--set",
                         "Stop.max_views=" + std::to_string(views),
                         "--out",
                         out.string()} +
               kSmallCamera;
    }
    static Arguments resume(const std::filesystem::path& run, int views) {
        return {"--resume", run.string(), "--set", "Stop.max_views=" + std::to_string(views),
                "--no-progress"};
    }
    static void cutEnd(const std::filesystem::path& file, std::size_t bytes) {
        std::filesystem::resize_file(file, std::filesystem::file_size(file) - bytes);
    }
    /// As a run looks that was killed while it wrote: no summary, and parts of lines and objects.
    static void kill(const std::filesystem::path& run) {
        for (const auto* name : {"summary.yaml", "graph.ply", "rifts.csv", "report.html"}) {
            std::filesystem::remove(run / name);
        }
        std::filesystem::rename(run / "run.rawlog", run / "run.rawlog.part");
        cutEnd(run / "run.rawlog.part", 100);
        cutEnd(run / "steps.csv", 7);
        cutEnd(run / "gains.csv", 3);
    }
    /// Without the columns of measured times.
    static std::string withoutTimes(const std::filesystem::path& file) {
        const CsvTable table = readCsv(file);
        std::string text;
        for (const auto& row : table.rows) {
            for (std::size_t i = 0; i < row.size(); ++i) {
                const std::string& name = table.header[i];
                text += name.ends_with("_ms") || name == "seconds" ? "" : row[i] + ",";
            }
            text += "\n";
        }
        return text;
    }
    static void expectSame(const std::filesystem::path& a, const std::filesystem::path& b) {
        for (const auto* name :
             {"graph.ply", "run.rawlog", "trajectory.tum", "rifts.csv", "rift_cells.csv",
              "coverage.csv", "gains.csv", "map.png", "map_2.png", "config_used.ini"}) {
            if (std::filesystem::exists(a / name)) {
                EXPECT_EQ(readFile(a / name), readFile(b / name)) << name;
            }
        }
        EXPECT_EQ(withoutTimes(a / "steps.csv"), withoutTimes(b / "steps.csv"));
        for (const auto* figure : {"auc_10: ", "path_to_90_m: ", "explained: ", "stop_reason: "}) {
            EXPECT_EQ(lineWith(a / "summary.yaml", figure), lineWith(b / "summary.yaml", figure));
        }
    }
    static std::string lineWith(const std::filesystem::path& file, const std::string& start) {
        std::istringstream lines(readFile(file));
        for (std::string line; std::getline(lines, line);) {
            if (line.starts_with(start)) {
                return line;
            }
        }
        return "";
    }
    /// The first rows, times and all.
    static std::string beginning(const std::filesystem::path& file, int lines) {
        const std::string text = readFile(file);
        std::size_t end = 0;
        for (int i = 0; i < lines; ++i) {
            end = text.find('\n', end) + 1;
        }
        return text.substr(0, end);
    }

    TemporaryFolder folder_;
    std::filesystem::path whole_ = folder_ / "whole";
    std::filesystem::path cut_ = folder_ / "cut";
};

TEST_F(ExploreResumed, aKilledRunGoesOnWithWhatItHasSeen) {
    for (const std::string noise : {"N0", "N3", "N4"}) {
        SCOPED_TRACE(noise);
        const std::string judge = noise == "N3" ? "true" : "false";
        const auto whole = whole_ / noise;
        const auto cut = cut_ / noise;
        ASSERT_EQ(explore(sculpture(whole, noise, 6, judge)), 0);
        ASSERT_EQ(explore(sculpture(cut, noise, 4, judge)), 0);
        kill(cut);
        const std::string before = beginning(cut / "steps.csv", 4);  // the fourth view was cut
        ASSERT_EQ(explore(resume(cut, 6)), 0);
        expectSame(whole, cut);
        EXPECT_EQ(beginning(cut / "steps.csv", 4), before) << "not the times of the first run";
        EXPECT_EQ(readCsv(cut / "steps.csv").rows.size(), 6U);
        EXPECT_FALSE(std::filesystem::exists(cut / "run.rawlog.part"));
        BuildProgram build;
        ASSERT_EQ(
            runProgram(build, {(cut / "config_build.ini").string(), (cut / "run.rawlog").string(),
                               "--out", (cut / "built").string(), "--no-progress"}),
            0);
        EXPECT_EQ(readFile(cut / "graph.ply"), readFile(cut / "built" / "graph.ply"));
    }
}

/// A negative of the last pair matches as well, but its colours tell where the map is from.
TEST_F(ExploreResumed, whatIsRecordedIsNotRenderedAgain) {
    ASSERT_EQ(explore(sculpture(whole_, "N4", 3, "false")), 0);
    ASSERT_EQ(explore(sculpture(cut_, "N4", 2, "false")), 0);
    std::vector<std::string> images;
    for (const auto& entry : std::filesystem::directory_iterator(cut_ / "run_Images")) {
        images.push_back(entry.path().string());
    }
    ASSERT_EQ(images.size(), 4U);
    std::sort(images.begin(), images.end());
    for (const std::string& name : {images[2], images[3]}) {
        cv::imwrite(name, 255 - cv::imread(name, cv::IMREAD_UNCHANGED));
    }
    ASSERT_EQ(explore(resume(cut_, 3)), 0);
    EXPECT_NE(readFile(whole_ / "graph.ply"), readFile(cut_ / "graph.ply"));
}

TEST_F(ExploreResumed, aRunThatWasKilledBeforeItsFirstViewBegins) {
    ASSERT_EQ(explore(sculpture(whole_, "N0", 2, "false")), 0);
    ASSERT_EQ(explore(sculpture(cut_, "N0", 2, "false")), 0);
    for (const auto* name : {"summary.yaml", "steps.csv", "trajectory.tum", "run.rawlog"}) {
        std::filesystem::remove(cut_ / name);
    }
    ASSERT_EQ(explore(resume(cut_, 2)), 0);
    expectSame(whole_, cut_);
}

TEST_F(ExploreResumed, aRunThatHasEndedIsLeftAlone) {
    ASSERT_EQ(explore(sculpture(cut_, "N0", 2, "false")), 0);
    const std::string before = readFile(cut_ / "summary.yaml");
    testing::internal::CaptureStdout();
    ASSERT_EQ(explore(resume(cut_, 2)), 0);
    EXPECT_NE(testing::internal::GetCapturedStdout().find("has ended (max_views)"),
              std::string::npos);
    EXPECT_EQ(readFile(cut_ / "summary.yaml"), before);
}

TEST_F(ExploreResumed, whatCannotGoOnIsToldInOneLine) {
    EXPECT_EQ(explore({"--resume", (folder_ / "nowhere").string()}), 2);
    ASSERT_EQ(explore(sculpture(cut_, "N0", 3, "false")), 0);
    kill(cut_);
    const auto failure = [&](const Arguments& more) {
        testing::internal::CaptureStderr();
        const int code = explore(resume(cut_, 4) + more);
        return std::to_string(code) + " " + testing::internal::GetCapturedStderr();
    };
    std::filesystem::rename(cut_ / "gains.csv", cut_ / "elsewhere");
    const std::string steps = readFile(cut_ / "steps.csv");
    const std::string missing = failure({});
    EXPECT_EQ(missing[0], '1') << missing;
    EXPECT_NE(missing.find("gains.csv: missing"), std::string::npos) << missing;
    folder_.write("cut/gains.csv", "view,expected_tears_m2\n0,0\n1,1\n");
    const std::string older = failure({});
    EXPECT_NE(older.find("no column 'expected_share'"), std::string::npos) << older;
    EXPECT_EQ(readFile(cut_ / "steps.csv"), steps) << "changed by what did not go on";
    std::filesystem::rename(cut_ / "elsewhere", cut_ / "gains.csv");
    const std::string other = failure({"--set", "Planner.view_cost=1"});
    EXPECT_EQ(other[0], '2') << other;
    EXPECT_NE(other.find("Planner.view_cost"), std::string::npos) << other;
    const std::string gains = beginning(cut_ / "gains.csv", 3);  // steps.csv has two views
    // A configuration that was tampered with stands for a version that plans otherwise.
    std::string config = readFile(cut_ / "config_used.ini");
    const std::string seed = "\nseed = 0";
    ASSERT_NE(config.find(seed), std::string::npos);
    config.replace(config.find(seed), seed.size(), "\nseed = 7");
    folder_.write("cut/config_used.ini", config);
    const std::string elsewhere = failure({});
    EXPECT_EQ(elsewhere[0], '1') << elsewhere;
    EXPECT_NE(elsewhere.find("is not from where this run would take it"), std::string::npos)
        << elsewhere;
    EXPECT_EQ(readFile(cut_ / "gains.csv"), gains) << "changed by what did not go on";
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

TEST(Explore, saysOfTheRunWhatTheJudgeSaysOfItsMap) {
    const TemporaryFolder folder;
    const std::string run = (folder / "run").string();
    ExploreProgram program;
    ASSERT_EQ(
        runProgram(program,
                   Arguments{kConfig + "explore-sculpture.ini", "--set", "Noise.level=N0", "--set",
                             "Graph.target_resolution=0.04", "--set", "Graph.gamma=0.01", "--set",
                             "Eval.deltas=0.04", "--set", "Eval.headline=0.04", "--set",
                             "Eval.samples=20000", "--set", "Stop.max_views=3", "--out", run} +
                       kSmallCamera),
        0);
    EvalProgram judge;
    ASSERT_EQ(runProgram(judge, {run + "/config_used.ini", "--map", run + "/map.pixelgraph",
                                 "--no-progress", "--out", (folder / "judged").string()}),
              0);
    EXPECT_GT(program.coverage.explained, 0.5);
    EXPECT_EQ(program.coverage.explained, judge.report.explained);
    EXPECT_EQ(program.coverage.at.front().cObs, judge.report.at.front().cObs);
    EXPECT_EQ(program.coverage.at.front().accuracy, judge.report.at.front().accuracy);
    EXPECT_EQ(program.coverage.verdicts, judge.report.verdicts);
}

}  // namespace
}  // namespace riftmap
