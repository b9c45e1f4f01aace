// SPDX-License-Identifier: BSD-3-Clause
// riftmap-eval from its command line: maps and worlds that no one of us made, and bad input.
#include "riftmap/apps/eval_program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "riftmap/core/file.h"
#include "riftmap/core/ply.h"
#include "shapes.h"
#include "temporary_folder.h"

namespace riftmap {
namespace {

using ::testing::HasSubstr;

/// Text of a mesh as Wavefront OBJ.
std::string obj(const TriangleMesh& mesh) {
    std::ostringstream out;
    for (const auto& v : mesh.vertices) {
        out << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
    }
    for (const auto& t : mesh.triangles) {
        out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
    }
    return out.str();
}

/// An ascii PLY with other properties than ours, as a stranger would write it.
std::string foreignPly(const std::vector<Eigen::Vector3f>& points) {
    std::ostringstream out;
    out << "ply\nformat ascii 1.0\ncomment by a stranger\nelement vertex " << points.size()
        << "\nproperty uchar quality\nproperty double x\nproperty double y\nproperty double z\n"
           "element face 0\nproperty list uchar int vertex_indices\nend_header\n";
    for (const auto& p : points) {
        out << "7 " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
    }
    return out.str();
}

class EvalCommand : public ::testing::Test {
 protected:
    EvalCommand() {
        const TriangleMesh ball = shapes::sphere(0.5, 60);
        folder_.write("ball.obj", obj(ball));
        EvalOptions options;
        options.samples = 200000;
        folder_.write("map.ply", foreignPly(groundTruthSamples(ball, options).points));
    }
    struct Outcome {
        int code = 0;
        std::string out, err;
    };
    Outcome eval(EvalProgram& program, std::vector<std::string> arguments) {
        for (const char* common : {"--set", "Eval.cache=none", "--no-progress"}) {
            arguments.emplace_back(common);
        }
        testing::internal::CaptureStdout();
        testing::internal::CaptureStderr();
        Outcome outcome;
        outcome.code = runProgram(program, arguments);
        outcome.out = testing::internal::GetCapturedStdout();
        outcome.err = testing::internal::GetCapturedStderr();
        return outcome;
    }
    /// Expects this exit code and one line on stderr that holds the text.
    void expectError(const std::vector<std::string>& arguments, int code, const std::string& text) {
        EvalProgram program;
        const Outcome outcome = eval(program, arguments);
        EXPECT_EQ(outcome.code, code) << outcome.err;
        EXPECT_THAT(outcome.err, HasSubstr(text));
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    }
    std::string in(const std::string& name) const { return (folder_ / name).string(); }

    test::TemporaryFolder folder_;
};

TEST_F(EvalCommand, JudgesAMapAndAWorldOfStrangers) {
    EvalProgram program;
    const Outcome outcome =
        eval(program, {"--map", in("map.ply"), "--world", in("ball.obj"), "--out", in("verdict")});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_GT(program.report.atDelta(0.005).cObs, 0.98);
    EXPECT_EQ(program.report.atDelta(0.002).accuracy, 1.0);
    EXPECT_TRUE(std::isnan(program.report.explained)) << "no certificate was given";
    EXPECT_NEAR(program.meshArea, 3.1416, 0.005 * 3.1416);
    EXPECT_THAT(outcome.out, HasSubstr("5mm"));
    for (const char* name : {"summary.yaml", "coverage.csv", "samples.ply", "manifest.yaml",
                             "config_used.ini", "coverage_0.png", "error_2.png"}) {
        EXPECT_TRUE(std::filesystem::exists(folder_ / ("verdict/" + std::string(name)))) << name;
    }
    EXPECT_THAT(readFile(folder_ / "verdict/summary.yaml"), HasSubstr("c_obs_5mm: 0.9"));
    EXPECT_EQ(readPly(folder_ / "verdict/samples.ply").points.size(), 10000U);
}

TEST_F(EvalCommand, ACertificateExplains) {
    folder_.write("rifts.csv",
                  "id,state,reason,type,x,y,z,nx,ny,nz,open_vertices,edges,attempts\n"
                  "1,resolved,,depth_step,0,0,0.5,0,0,1,5,5,1\n");
    EvalProgram program;
    EXPECT_EQ(eval(program, {"--map", in("map.ply"), "--world", in("ball.obj"), "--out",
                             in("verdict"), "--set", "Judge.pictures=false"})
                  .code,
              0);
    EXPECT_LT(program.report.explained, 1.0) << "nothing but a resolved rift is listed";
}

/// Whoever has rift_cells.csv is judged by its cells: a rift's one centre says little of a long
/// one.
TEST_F(EvalCommand, ACertificateIsJudgedByItsCells) {
    const std::string columns = "state,x,y,z\n";
    folder_.write("rifts.csv", columns + "unobservable,0,0,0.5\n");
    folder_.write("rift_cells.csv", columns + "unobservable,0,0,0.5\nunobservable,0,0.5,0\n" +
                                        "unreachable,0.5,0,0\nbelow_resolution,-0.5,0,0\n");
    EvalProgram program;
    EXPECT_EQ(eval(program, {"--map", in("map.ply"), "--world", in("ball.obj"), "--out",
                             in("verdict"), "--set", "Judge.pictures=false"})
                  .code,
              0);
    EXPECT_EQ(program.report.verdicts, 3U);
}

TEST_F(EvalCommand, SameVerdictForOneAndTwoThreads) {
    std::string verdicts[2];
    std::string pictures[2];
    for (int i = 0; i < 2; ++i) {
        EvalProgram program;
        const std::string out = "verdict" + std::to_string(i);
        ASSERT_EQ(eval(program, {"--map", in("map.ply"), "--world", in("ball.obj"), "--out",
                                 in(out), "--threads", std::to_string(i + 1)})
                      .code,
                  0);
        verdicts[i] = readFile(folder_ / (out + "/summary.yaml")) +
                      readFile(folder_ / (out + "/samples.ply"));
        pictures[i] = readFile(folder_ / (out + "/coverage_0.png"));
    }
    EXPECT_EQ(verdicts[0], verdicts[1]);
    EXPECT_EQ(pictures[0], pictures[1]);
}

TEST_F(EvalCommand, BadMapsAreOneLine) {
    const std::vector<std::string> rest{"--world", in("ball.obj"), "--out", in("verdict")};
    const auto with = [&](const std::string& map) {
        std::vector<std::string> arguments{"--map", map};
        arguments.insert(arguments.end(), rest.begin(), rest.end());
        return arguments;
    };
    expectError(rest, 2, "--map is missing");
    expectError(with(in("absent.ply")), 1, "absent.ply");
    expectError(with(in("absent.pixelgraph")), 1, "absent.pixelgraph");
    folder_.write("empty.ply", "");
    expectError(with(in("empty.ply")), 1, "empty.ply");
    folder_.write("text.ply", "this is no map\n");
    expectError(with(in("text.ply")), 1, "text.ply");
    folder_.write("none.ply", foreignPly({}));
    expectError(with(in("none.ply")), 1, "no vertices");
    EXPECT_FALSE(std::filesystem::exists(folder_ / "verdict"));
}

TEST_F(EvalCommand, BadWorldsAndStartsAreOneLine) {
    expectError({"--map", in("map.ply"), "--world", "nowhere.obj", "--out", in("verdict")}, 1,
                "nowhere.obj");
    expectError({"--map", in("map.ply"), "--world", in("ball.obj"), "--out", in("verdict"), "--set",
                 "Platform.start=0.52 0 0 0 0"},
                2, "start");
    expectError({"--map", in("map.ply"), "--world", in("ball.obj"), "--out", in("verdict"), "--set",
                 "Eval.delta=1"},
                2, "deltas");
}

}  // namespace
}  // namespace riftmap
