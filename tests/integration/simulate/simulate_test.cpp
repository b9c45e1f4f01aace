// SPDX-License-Identifier: BSD-3-Clause
// riftmap-simulate through its command line; what it writes is read back as riftmap-build does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/config/CConfigFile.h>

#include <map>

#include "riftmap/apps/rawlog_reader.h"
#include "riftmap/apps/simulate_program.h"
#include "riftmap/apps/stored_disparity.h"
#include "riftmap/core/file.h"
#include "riftmap/core/pfm.h"
#include "riftmap/core/tum.h"
#include "temporary_folder.h"

namespace riftmap {
namespace {

using testing::HasSubstr;

std::vector<std::string> command(const std::string& out,
                                 const std::vector<std::string>& sets = {}) {
    std::vector<std::string> arguments = {"--no-progress", "--out", out};
    for (const std::string common :
         {"World.name=sculpture", "Camera.width=96", "Camera.height=72", "Camera.f=80",
          "Camera.num_disparities=24", "Trajectory.views=4"}) {
        arguments.insert(arguments.end(), {"--set", common});
    }
    for (const auto& set : sets) {
        arguments.insert(arguments.end(), {"--set", set});
    }
    return arguments;
}

int simulate(std::vector<std::string> arguments, const std::vector<std::string>& more = {}) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    SimulateProgram program;
    return runProgram(program, arguments);
}

std::vector<StereoObservation> read(const std::string& file) {
    RawlogReader reader(file, {});
    std::vector<StereoObservation> all;
    while (auto view = reader.next()) {
        view->left = view->left.clone();
        view->right = view->right.clone();
        all.push_back(std::move(*view));
    }
    return all;
}

std::map<std::string, std::string> hashes(const std::filesystem::path& folder) {
    std::map<std::string, std::string> result;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (entry.is_regular_file()) {
            result[std::filesystem::relative(entry.path(), folder).string()] =
                sha256OfFile(entry.path());
        }
    }
    return result;
}

TEST(Simulate, WritesWhatTheReaderReads) {
    const test::TemporaryFolder folder;
    const auto file = folder / "x.rawlog";
    ASSERT_EQ(simulate(command(file.string())), 0);
    const auto views = read(file.string());
    const auto truth = readTum(folder / "x_gt.tum");
    ASSERT_EQ(views.size(), 4U);
    ASSERT_EQ(truth.size(), 4U);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(views[i].time_ns, truth[i].time_ns) << "exact";
        EXPECT_TRUE(views[i].world_T_camera.rotation.isApprox(truth[i].pose.rotation, 1e-6));
        EXPECT_TRUE(views[i].world_T_camera.translation.isApprox(truth[i].pose.translation, 1e-6));
        EXPECT_EQ(views[i].camera.fx, 80);
        EXPECT_NEAR(views[i].camera.baseline, 0.12, 1e-12);
        EXPECT_EQ(views[i].right.cols, 96);
        EXPECT_FALSE(views[i].disparity);
    }
    mrpt::img::TStereoCamera calibration;
    calibration.loadFromConfigFile(
        "CAMERA", mrpt::config::CConfigFile((folder / "x_calibration.ini").string()));
    EXPECT_EQ(calibration.leftCamera.fx(), 80);
    EXPECT_NEAR(calibration.rightCameraPose.x, 0.12, 1e-9);
}

TEST(Simulate, SameSeedSameBytesForOneAndTwoThreads) {
    const test::TemporaryFolder folder;
    for (const std::string threads : {"1", "2"}) {
        const auto file = folder / threads / "x.rawlog";
        ASSERT_EQ(simulate(command(file.string(), {"PoseNoise.position=0.01"}),
                           {"--seed", "5", "--threads", threads}),
                  0);
    }
    const auto one = hashes(folder / "1");
    EXPECT_EQ(one.size(), 3U + 8U) << "rawlog, truth, calibration, eight images";
    EXPECT_EQ(one, hashes(folder / "2"));
    ASSERT_EQ(simulate(command((folder / "3" / "x.rawlog").string(), {"PoseNoise.position=0.01"}),
                       {"--seed", "6"}),
              0);
    EXPECT_NE(one.at("x.rawlog"), hashes(folder / "3").at("x.rawlog"));
}

TEST(Simulate, DisparityOfN0AndN3SurvivesTheFileBitForBit) {
    const test::TemporaryFolder folder;
    for (const std::string level : {"N0", "N3"}) {
        const std::vector<std::string> sets = {"Noise.level=" + level};
        const auto file = (folder / (level + ".rawlog")).string();
        ASSERT_EQ(simulate(command(file, sets)), 0);
        SimulatedViewsOptions options;
        OptionTable table;
        options.describe(table);
        const auto arguments = command("", sets);
        for (std::size_t i = 0; i + 1 < arguments.size(); ++i) {
            if (arguments[i] == "--set") {
                table.set(arguments[i + 1]);
            }
        }
        const SimulatedViews expected(options, 0);
        const auto views = read(file);
        ASSERT_EQ(views.size(), expected.count());
        for (std::size_t i = 0; i < views.size(); ++i) {
            const DisparityImage direct = *expected.observation(i).disparity;
            ASSERT_TRUE(views[i].disparity);
            EXPECT_EQ(views[i].disparity->disparity, direct.disparity);
            EXPECT_EQ(views[i].disparity->sigma, direct.sigma);
            EXPECT_EQ(views[i].disparity->firstColumn, direct.firstColumn);
            EXPECT_EQ(views[i].disparity->minDisparity, direct.minDisparity);
            EXPECT_EQ(views[i].disparity->maxDisparity, direct.maxDisparity);
        }
    }
}

TEST(Simulate, LensDistortionIsInTheCalibrationAndComesOutRectified) {
    const test::TemporaryFolder folder;
    const auto file = (folder / "d.rawlog").string();
    ASSERT_EQ(simulate(command(file, {"Camera.distortion=-0.2 0.05 0 0 0"})), 0);
    const auto contents = scanRawlog(file, {});
    EXPECT_FALSE(contents.sensors.at("stereo").rectified);
    EXPECT_NEAR(contents.sensors.at("stereo").calibration.leftCamera.dist[0], -0.2, 1e-12);
    EXPECT_EQ(read(file).size(), 4U);
    EXPECT_EQ(simulate(command((folder / "n.rawlog").string(),
                               {"Camera.distortion=-0.2 0 0 0 0", "Noise.level=N0"})),
              2);
}

TEST(Simulate, PoseNoiseIsInTheRawlogAndNotInTheTruth) {
    const test::TemporaryFolder folder;
    const auto file = (folder / "p.rawlog").string();
    ASSERT_EQ(simulate(command(file, {"PoseNoise.position_drift=0.05", "Trajectory.views=12"})), 0);
    ASSERT_EQ(simulate(command((folder / "q.rawlog").string(), {"Trajectory.views=12"})), 0);
    EXPECT_EQ(sha256OfFile(folder / "p_gt.tum"), sha256OfFile(folder / "q_gt.tum"));
    const auto views = read(file);
    const auto truth = readTum(folder / "p_gt.tum");
    EXPECT_LT((views.front().world_T_camera.translation - truth.front().pose.translation).norm(),
              1e-6);
    EXPECT_GT((views.back().world_T_camera.translation - truth.back().pose.translation).norm(),
              0.02);
}

TEST(Simulate, TruthImagesAreExactDepthAndDisparity) {
    const test::TemporaryFolder folder;
    ASSERT_EQ(simulate(command((folder / "t.rawlog").string(), {"Record.truth_images=true"})), 0);
    const FloatImage depth = readPfm(folder / "t_truth" / "depth_2.pfm");
    const FloatImage disparity = readPfm(folder / "t_truth" / "disparity_2.pfm");
    int seen = 0;
    for (std::size_t i = 0; i < depth.values.size(); ++i) {
        ASSERT_EQ(std::isfinite(depth.values[i]), std::isfinite(disparity.values[i]));
        if (std::isfinite(depth.values[i])) {
            EXPECT_NEAR(disparity.values[i], 80 * 0.12F / depth.values[i], 1e-4F);
            ++seen;
        }
    }
    EXPECT_GT(seen, 300);
}

TEST(Simulate, WrongUseIsNamed) {
    const test::TemporaryFolder folder;
    const auto out = (folder / "x.rawlog").string();
    const std::pair<std::string, int> cases[] = {
        {"World.mesh=none.ply", 1},       {"World.name=attic", 2},      {"Trajectory.radius=9", 2},
        {"Trajectory.kind=waypoints", 2}, {"Trajectory.centre=1 2", 2}, {"Trajectory.kind=tum", 2},
        {"Trajectory.radius=0.05", 2},
    };
    for (const auto& [set, code] : cases) {
        testing::internal::CaptureStderr();
        EXPECT_EQ(simulate(command(out, {set})), code) << set;
        const std::string text = testing::internal::GetCapturedStderr();
        EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
        EXPECT_FALSE(std::filesystem::exists(out)) << set;
    }
    testing::internal::CaptureStderr();
    EXPECT_EQ(simulate(command((folder / "x.log").string())), 2);
    EXPECT_EQ(simulate(command(out)), 0);
    EXPECT_EQ(simulate(command(out)), 2) << "not over an older one";
    EXPECT_EQ(simulate(command(out), {"-w"}), 0);
    EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("-w overwrites it"));
}

TEST(StoredDisparity, KeepsASigmaForEveryPixelToo) {
    DisparityImage image;
    image.resize(8, 3);
    for (std::size_t i = 0; i < image.disparity.size(); i += 2) {
        image.disparity[i] = 1.1F * static_cast<float>(i);
        image.sigma[i] = 0.1F + 0.01F * static_cast<float>(i);
    }
    mrpt::obs::CObservationStereoImages pair;
    pair.leftCamera.ncols = 8;
    pair.leftCamera.nrows = 3;
    EXPECT_FALSE(loadDisparity(pair));
    storeDisparity(image, pair);
    const auto back = loadDisparity(pair);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->disparity, image.disparity);
    EXPECT_EQ(back->sigma, image.sigma);
    pair.leftCamera.nrows = 4;
    EXPECT_THROW(loadDisparity(pair), std::runtime_error);
}

}  // namespace
}  // namespace riftmap
