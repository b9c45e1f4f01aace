// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "riftmap/apps/build_program.h"
#include "riftmap/apps/import_program.h"
#include "riftmap/apps/info_program.h"
#include "riftmap/apps/rawlog_writer.h"
#include "riftmap/core/csv.h"
#include "riftmap/core/file.h"
#include "riftmap/core/ply.h"
#include "riftmap/core/tum.h"
#include "riftmap/maps/map_file.h"
#include "temporary_folder.h"
#include "textured_pair.h"

namespace riftmap {
namespace {

using test::TemporaryFolder;
using test::texturedPair;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t kSecond = 1'000'000'000;

Pose ahead(double x, double y) {
    return Pose{forwardCamera().rotation, {x, y, 0}};
}

/// `count` times the same picture from the same place: a camera at rest.
std::string restingRawlog(const TemporaryFolder& folder, int count) {
    const auto file = folder / "rest.rawlog";
    RawlogWriter writer(file);
    for (int i = 0; i < count; ++i) {
        writer.write(texturedPair(i * kSecond, ahead(0, 0)));
    }
    writer.finish();
    return file.string();
}

std::vector<std::string> arguments(const std::string& input, const std::filesystem::path& out) {
    return {input,        "--out",
            out.string(), "--no-progress",
            "-s",         "Stereo.num_disparities=16",
            "-s",         "Graph.target_resolution=0.05"};
}

/// Exit code and the one line on stderr of a program run through its arguments.
template <class P>
std::pair<int, std::string> outcome(const std::vector<std::string>& arguments) {
    P program;
    ::testing::internal::CaptureStderr();
    ::testing::internal::CaptureStdout();
    const int code = runProgram(program, arguments);
    ::testing::internal::GetCapturedStdout();
    return {code, ::testing::internal::GetCapturedStderr()};
}

std::string summaryValue(const std::filesystem::path& run, const std::string& key) {
    const auto text = readFile(run / "summary.yaml");
    const auto at = text.find(key + ": ");
    if (at == std::string::npos) {
        ADD_FAILURE() << "no " << key << " in the summary";
        return {};
    }
    const auto from = at + key.size() + 2;
    return text.substr(from, text.find('\n', from) - from);
}

TEST(Build, WritesEveryFileOfTheContract) {
    const TemporaryFolder folder;
    const auto run = folder / "run";
    const auto [code, error] = outcome<BuildProgram>(arguments(restingRawlog(folder, 3), run));
    ASSERT_EQ(code, 0) << error;
    for (const auto* name :
         {"graph.ply", "map.pixelgraph", "scene.3Dscene", "trajectory.tum", "steps.csv",
          "rifts.csv", "summary.yaml", "config_used.ini", "manifest.yaml", "disparity.png",
          "graph_detail.png", "rifts_first.png", "rifts.png", "keyframes.simplemap",
          "planned_path.tum"}) {
        EXPECT_TRUE(std::filesystem::exists(run / name)) << name;
    }
    for (const auto& entry : std::filesystem::directory_iterator(run)) {
        EXPECT_THAT(entry.path().filename().string(), ::testing::Not(HasSubstr("part")));
    }
    EXPECT_EQ(readTum(run / "trajectory.tum").size(), 3U);
    const auto steps = readCsv(run / "steps.csv");
    ASSERT_EQ(steps.rows.size(), 3U);
    const auto vertices = std::stoul(summaryValue(run, "vertices"));
    const auto raw = std::stoul(summaryValue(run, "raw_points"));
    EXPECT_EQ(readPly(run / "graph.ply").points.size(), vertices);
    EXPECT_EQ(loadMap(run / "map.pixelgraph").graph().vertexCount(), vertices);
    // The same picture three times over adds no vertex and no edge to what the first one gave.
    EXPECT_EQ(raw, 3 * std::stoul(steps.rows[0][steps.column("raw_points")]));
    EXPECT_EQ(std::to_string(vertices), steps.rows[0][steps.column("vertices")]);
    EXPECT_EQ(summaryValue(run, "edges"), steps.rows[0][steps.column("edges")]);
    EXPECT_EQ(summaryValue(run, "stop_reason"), "end_of_input");
    // The square before the wall has a tear around it, and there is a way to it.
    EXPECT_GT(std::stoul(summaryValue(run, "rifts_open")), 0U);
    EXPECT_FALSE(readTum(run / "planned_path.tum").empty());
}

TEST(Build, TheKeyframesGiveTheSameMapAgain) {
    const TemporaryFolder folder;
    ASSERT_EQ(outcome<BuildProgram>(arguments(restingRawlog(folder, 2), folder / "a")).first, 0);
    ASSERT_EQ(outcome<BuildProgram>(
                  arguments((folder / "a" / "keyframes.simplemap").string(), folder / "b"))
                  .first,
              0);
    EXPECT_EQ(readFile(folder / "a" / "graph.ply"), readFile(folder / "b" / "graph.ply"));
}

TEST(Build, TheNumberOfThreadsChangesNoByte) {
    const TemporaryFolder folder;
    const auto rawlog = restingRawlog(folder, 2);
    for (const auto* threads : {"1", "2", "4"}) {
        auto args = arguments(rawlog, folder / threads);
        args.insert(args.end(), {"--threads", threads});
        ASSERT_EQ(outcome<BuildProgram>(args).first, 0);
    }
    for (const auto* name : {"graph.ply", "rifts.csv", "rifts.png"}) {
        EXPECT_EQ(readFile(folder / "1" / name), readFile(folder / "2" / name)) << name;
        EXPECT_EQ(readFile(folder / "1" / name), readFile(folder / "4" / name)) << name;
    }
}

TEST(Build, KeepsWhatCameBeforeTheDamage) {
    const TemporaryFolder folder;
    {
        RawlogWriter writer(folder / "whole.rawlog");
        for (std::uint32_t i = 0; i < 4; ++i) {  // pictures that do not shrink
            writer.write(texturedPair(i * kSecond, ahead(0, 0), i + 1));
        }
        writer.finish();
    }
    const auto bytes = readFile(folder / "whole.rawlog");
    const auto cut = folder.write("cut.rawlog", bytes.substr(0, bytes.size() * 7 / 10));
    const auto [code, error] = outcome<BuildProgram>(arguments(cut.string(), folder / "run"));
    EXPECT_EQ(code, 1);
    EXPECT_THAT(error, AllOf(HasSubstr("cut.rawlog: damaged after object"), HasSubstr("byte")));
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1);
    EXPECT_EQ(summaryValue(folder / "run", "views"), "2");
    EXPECT_EQ(summaryValue(folder / "run", "stop_reason"), "input_damaged");
    EXPECT_GT(readPly(folder / "run" / "graph.ply").points.size(), 1000U);
}

/// Each broken input with its exit code and what its message must name.
TEST(Build, BrokenInput) {
    const TemporaryFolder folder;
    const auto good = restingRawlog(folder, 1);
    const auto noPoses = folder / "no_poses.rawlog";
    {
        RawlogWriter writer(noPoses);
        auto pair = toMrpt(texturedPair(0), forwardCamera(), "stereo");
        writer.pair(*pair);
        writer.finish();
    }
    const auto nanPose = folder / "nan.rawlog";
    const auto sizes = folder / "sizes.rawlog";
    {
        RawlogWriter writer(nanPose);
        writer.robotPose(0, ahead(std::numeric_limits<double>::quiet_NaN(), 0));
        auto pair = toMrpt(texturedPair(0), forwardCamera(), "stereo");
        writer.pair(*pair);
        writer.finish();
        RawlogWriter other(sizes);
        other.robotPose(0, ahead(0, 0));
        pair->imageRight = mrpt::img::CImage(80, 60, mrpt::img::CH_GRAY);
        other.pair(*pair);
        other.finish();
    }
    const auto empty = folder.write("empty.rawlog", "");
    const auto text = folder.write("text.rawlog", "this is no rawlog\n");
    const auto badKey = folder.write("key.ini", "[Graph]\ndeltta = 0.1\n");
    const auto badNumber = folder.write("number.ini", "[Graph]\ndelta = far\n");
    const auto badRange = folder.write("range.ini", "[Graph]\nvisibility = 1.5\n");
    const auto badSection = folder.write("section.ini", "[Grapf]\ndelta = 1\n");

    struct Case {
        std::vector<std::string> arguments;
        int code;
        std::vector<std::string> says;
    };
    const auto out = (folder / "out").string();
    const std::vector<Case> cases = {
        {{(folder / "none.rawlog").string(), "--out", out}, 1, {"none.rawlog", "no such file"}},
        {{folder.path().string(), "--out", out}, 1, {"not a file"}},
        {{empty.string(), "--out", out}, 1, {"empty.rawlog", "empty"}},
        {{text.string(), "--out", out}, 1, {"text.rawlog", "not a rawlog"}},
        {{noPoses.string(), "--out", out}, 1, {"no_poses.rawlog", "no poses", "--poses"}},
        {{nanPose.string(), "--out", out}, 1, {"nan.rawlog", "object 1", "not finite"}},
        {{sizes.string(), "--out", out}, 1, {"sizes.rawlog", "object 2", "80"}},
        {{badKey.string(), good, "--out", out}, 2, {"key.ini", "deltta", "delta"}},
        {{badNumber.string(), good, "--out", out}, 2, {"number.ini", "delta", "far"}},
        {{badRange.string(), good, "--out", out}, 2, {"range.ini", "visibility", "1.5"}},
        {{badSection.string(), good, "--out", out}, 2, {"section.ini", "Grapf"}},
        {{"no.ini", good, "--out", out}, 2, {"no.ini"}},
        {{good}, 2, {"--out"}},
        {{"--out", out}, 2, {"RAWLOG"}},
        {{good, "--out", out, "--set", "Graph.gamma=-1"}, 2, {"gamma", "-1"}},
        {{good, "--out", out, "--set", "Stereo.window=10"}, 2, {"window", "10", "odd"}},
        {{good, "--out", out, "--poses", "no.tum"}, 1, {"no.tum"}},
    };
    for (const auto& c : cases) {
        SCOPED_TRACE(::testing::PrintToString(c.arguments));
        const auto [code, error] = outcome<BuildProgram>(c.arguments);
        EXPECT_EQ(code, c.code) << error;
        EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
        EXPECT_THAT(error, ::testing::StartsWith("riftmap-build: "));
        for (const auto& word : c.says) {
            EXPECT_THAT(error, HasSubstr(word));
        }
        EXPECT_FALSE(std::filesystem::exists(out)) << "stands in the way of the next try";
        std::filesystem::remove_all(out);
    }
}

TEST(Build, RefusesADirectoryWithSomethingInIt) {
    const TemporaryFolder folder;
    const auto rawlog = restingRawlog(folder, 1);
    std::filesystem::create_directories(folder / "run");
    folder.write("run/precious.txt", "mine");
    const auto [code, error] = outcome<BuildProgram>(arguments(rawlog, folder / "run"));
    EXPECT_EQ(code, 2) << error;
    EXPECT_TRUE(std::filesystem::exists(folder / "run" / "precious.txt"));
}

TEST(Import, BrokenInput) {
    const TemporaryFolder folder;
    cv::imwrite((folder / "small.png").string(), cv::Mat(10, 10, CV_8UC1, cv::Scalar(9)));
    cv::imwrite((folder / "large.png").string(), cv::Mat(20, 10, CV_8UC1, cv::Scalar(9)));
    folder.write("text.png", "no image");
    folder.write("calib.txt", "cam0=[100 0 5; 0 100 5; 0 0 1]\ndoffs=0\nbaseline=abc\n");
    const auto small = (folder / "small.png").string();
    const auto large = (folder / "large.png").string();
    const auto out = (folder / "x.rawlog").string();
    struct Case {
        std::vector<std::string> arguments;
        int code;
        std::string says;
    };
    const std::vector<std::string> f = {"--set", "Pair.f=100", "--set", "Pair.baseline=0.1"};
    const auto with = [&f](std::vector<std::string> a) {
        a.insert(a.end(), f.begin(), f.end());
        return a;
    };
    const std::vector<Case> cases = {
        {{"tiff", small, "--out", out}, 2, "tiff"},
        {{"pair", small, "--out", out}, 2, "takes 2"},
        {{"pair", small, small, "--out", out}, 2, "calibration"},
        {with({"pair", small, large, "--out", out}), 1, "10x20"},
        {with({"pair", small, (folder / "text.png").string(), "--out", out}), 1, "text.png"},
        {with({"pair", small, (folder / "no.png").string(), "--out", out}), 1, "no.png"},
        {{"pair", small, small, "--calib", (folder / "calib.txt").string(), "--out", out},
         1,
         "baseline"},
        {{"kitti", (folder / "nowhere").string(), "--out", out}, 1, "nowhere"},
        {{"kitti", folder.path().string(), "--out", out}, 1, "image_0"},
        {{"euroc", folder.path().string(), "--out", out}, 1, "cam0"},
    };
    for (const auto& c : cases) {
        SCOPED_TRACE(::testing::PrintToString(c.arguments));
        const auto [code, error] = outcome<ImportProgram>(c.arguments);
        EXPECT_EQ(code, c.code) << error;
        EXPECT_THAT(error, HasSubstr(c.says));
        EXPECT_FALSE(std::filesystem::exists(out));
        EXPECT_FALSE(std::filesystem::exists(out + ".part"));
    }
}

TEST(Import, KittiPosesBecomeMapPoses) {
    const TemporaryFolder folder;
    for (const auto* side : {"image_0", "image_1"}) {
        std::filesystem::create_directories(folder / side);
        for (const auto* name : {"000000.png", "000001.png"}) {
            cv::imwrite((folder / side / name).string(), texturedPair(0).left);
        }
    }
    folder.write("calib.txt",
                 "P0: 100 0 80 0 0 100 60 0 0 0 1 0\nP1: 100 0 80 -54 0 100 60 0 0 0 1 0\n");
    // Two metres along the camera's z.
    folder.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 2\n");
    const auto out = folder / "k.rawlog";
    const auto [code, error] = outcome<ImportProgram>(
        {"kitti", folder.path().string(), "--out", out.string(), "--no-progress"});
    ASSERT_EQ(code, 0) << error;
    RawlogReader reader(out, {});
    const auto first = reader.next();
    const auto second = reader.next();
    ASSERT_TRUE(first && second);
    EXPECT_NEAR(first->camera.baseline, 0.54, 1e-12);
    EXPECT_EQ(second->time_ns, kSecond / 10);
    // Ahead is x, up is z.
    EXPECT_LT((second->world_T_camera.translation - Eigen::Vector3d(2, 0, 0)).norm(), 1e-9);
    EXPECT_LT((second->world_T_camera.rotation.col(1) + Eigen::Vector3d::UnitZ()).norm(), 1e-9);
}

TEST(Info, DescribesExportsAndCompares) {
    const TemporaryFolder folder;
    const auto rawlog = restingRawlog(folder, 2);
    const auto run = folder / "run";
    ASSERT_EQ(outcome<BuildProgram>(arguments(rawlog, run)).first, 0);
    const auto map = (run / "map.pixelgraph").string();
    const auto told = [](const std::vector<std::string>& args) {
        InfoProgram program;
        ::testing::internal::CaptureStdout();
        EXPECT_EQ(runProgram(program, args), 0);
        return ::testing::internal::GetCapturedStdout();
    };
    EXPECT_THAT(told({rawlog}), AllOf(HasSubstr("stereo_stereo_pairs: 2"), HasSubstr("160x120"),
                                      HasSubstr("damage: none")));
    EXPECT_THAT(told({map, run.string()}),
                AllOf(HasSubstr("vertices: " + summaryValue(run, "vertices")),
                      HasSubstr("kind: run"), HasSubstr("Graph.target_resolution: ")));
    EXPECT_THAT(told({map, "--compare", map}),
                AllOf(HasSubstr("only_in_a: 0"), HasSubstr("mean_distance_m: 0\n")));
    told({map, "--out", (folder / "points.ply").string()});
    EXPECT_EQ(readPly(run / "graph.ply").points, readPly(folder / "points.ply").points);
    EXPECT_EQ(outcome<InfoProgram>({folder.write("a.pixelgraph", "xx").string()}).first, 1);
    EXPECT_EQ(outcome<InfoProgram>({folder.write("a.xyz", "xx").string()}).first, 2);
}

}  // namespace
}  // namespace riftmap
