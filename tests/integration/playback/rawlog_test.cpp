// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <cmath>
#include <limits>

#include "riftmap/apps/rawlog_objects.h"
#include "riftmap/apps/rawlog_reader.h"
#include "riftmap/apps/rawlog_writer.h"
#include "riftmap/apps/simplemap_writer.h"
#include "riftmap/core/mrpt_time.h"
#include "riftmap/core/tum.h"
#include "temporary_folder.h"
#include "textured_pair.h"

namespace riftmap {
namespace {

using test::messageOf;
using test::TemporaryFolder;
using test::texturedPair;
using ::testing::HasSubstr;

constexpr std::int64_t kSecond = 1'000'000'000;

/// A camera that looks ahead from x metres along the way, turned a little.
Pose poseAt(double x) {
    return Pose{forwardCamera().rotation, {x, 0.1 * x, 1.0 / 3.0}};
}

std::vector<StereoObservation> readAll(RawlogReader& reader) {
    std::vector<StereoObservation> all;
    while (auto observation = reader.next()) {
        all.push_back(std::move(*observation));
    }
    return all;
}

std::vector<StereoObservation> readAll(const std::filesystem::path& file,
                                       const RawlogOptions& options = {},
                                       const std::filesystem::path& poses = {}) {
    RawlogReader reader(file, options, poses);
    return readAll(reader);
}

bool samePixels(const cv::Mat& a, const cv::Mat& b) {
    return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

double distance(const Pose& a, const Pose& b) {
    return (a.translation - b.translation).norm() + angleBetween(a, b);
}

/// Three views a second apart; returns the poses as a reader sees them.
std::vector<Pose> writeThree(const std::filesystem::path& file,
                             RawlogWriter::Images images = RawlogWriter::Images::kEmbedded) {
    RawlogWriter writer(file, images);
    std::vector<Pose> poses;
    for (int i = 0; i < 3; ++i) {
        poses.push_back(
            writer.write(texturedPair(i * kSecond, poseAt(i), static_cast<std::uint32_t>(i) + 1)));
    }
    writer.finish();
    return poses;
}

void put(mrpt::io::CFileGZOutputStream& stream, const mrpt::serialization::CSerializable& object) {
    mrpt::serialization::archiveFrom(stream) << object;
}

mrpt::obs::CObservationRobotPose robotPose(std::int64_t time_ns, double x) {
    mrpt::obs::CObservationRobotPose pose;
    pose.timestamp = toMrptTime(time_ns);
    pose.pose.mean = mrpt::poses::CPose3D(x, 0, 0, 0, 0, 0);
    return pose;
}

mrpt::obs::CObservationStereoImages::Ptr pairAt(std::int64_t time_ns) {
    return toMrpt(texturedPair(time_ns), forwardCamera(), "cam");
}

TEST(Rawlog, RoundTripIsExact) {
    const TemporaryFolder folder;
    for (const auto images : {RawlogWriter::Images::kEmbedded, RawlogWriter::Images::kExternal}) {
        // With a folder before the name, where MRPT's own search for external images fails.
        const auto file = folder / "set.rawlog";
        const auto poses = writeThree(file, images);
        const auto views = readAll(file);
        ASSERT_EQ(views.size(), 3U);
        for (std::size_t i = 0; i < 3; ++i) {
            const auto written = texturedPair(static_cast<std::int64_t>(i) * kSecond, {},
                                              static_cast<std::uint32_t>(i) + 1);
            EXPECT_EQ(views[i].time_ns, written.time_ns);
            EXPECT_TRUE(samePixels(views[i].left, written.left));
            EXPECT_TRUE(samePixels(views[i].right, written.right));
            EXPECT_EQ(views[i].camera.fx, written.camera.fx);
            EXPECT_EQ(views[i].camera.cx, written.camera.cx);
            EXPECT_EQ(views[i].camera.baseline, written.camera.baseline);
            EXPECT_EQ(views[i].camera.doffs, 0);
            // To the bit, as the writer promised, and near what was meant.
            EXPECT_EQ(views[i].world_T_camera.rotation, poses[i].rotation);
            EXPECT_EQ(views[i].world_T_camera.translation, poses[i].translation);
            EXPECT_LT(distance(poses[i], poseAt(static_cast<double>(i))), 1e-9);
        }
        std::filesystem::remove(file);
    }
}

TEST(Rawlog, RightPrincipalPointComesBackAsDoffs) {
    const TemporaryFolder folder;
    auto observation = texturedPair(0);
    observation.camera.doffs = 31.086;
    RawlogWriter writer(folder / "m.rawlog");
    writer.write(observation);
    writer.finish();
    EXPECT_NEAR(readAll(folder / "m.rawlog").at(0).camera.doffs, 31.086, 1e-12);
}

TEST(Rawlog, PosesAreInterpolatedAlsoWhenTheyComeAfterTheImages) {
    const TemporaryFolder folder;
    const auto file = folder / "late.rawlog";
    {
        mrpt::io::CFileGZOutputStream out(file.string());
        put(out, *pairAt(kSecond / 2));
        put(out, *pairAt(kSecond));
        put(out, *pairAt(5 * kSecond));        // in a gap of 3 s
        put(out, *pairAt(7 * kSecond));        // after the last pose
        for (const int s : {2, 0, 1, 4, 6}) {  // in no order
            put(out, robotPose(s * kSecond, s));
        }
    }
    RawlogReader reader(file, {});
    const auto views = readAll(reader);
    ASSERT_EQ(views.size(), 2U);
    EXPECT_NEAR(views[0].world_T_camera.translation.x(), 0.5, 1e-12);
    EXPECT_NEAR(views[1].world_T_camera.translation.x(), 1.0, 1e-12);
    EXPECT_LT(angleBetween(views[0].world_T_camera, forwardCamera()), 1e-9);
    EXPECT_EQ(reader.withoutPose(), 2U);

    RawlogOptions patient;
    patient.maxPoseGap = 10;
    EXPECT_EQ(readAll(file, patient).size(), 3U);
}

TEST(Rawlog, ActionsAddUpToPoses) {
    const TemporaryFolder folder;
    const auto file = folder / "actions.rawlog";
    {
        mrpt::io::CFileGZOutputStream out(file.string());
        for (int i = 1; i <= 3; ++i) {
            mrpt::obs::CActionRobotMovement3D step;
            step.poseChange.mean = mrpt::poses::CPose3D(0.5, 0, 0, M_PI / 2, 0, 0);
            mrpt::obs::CActionCollection actions;
            actions.insert(step);
            mrpt::obs::CSensoryFrame frame;
            frame.insert(pairAt(i * kSecond));
            put(out, actions);
            put(out, frame);
        }
    }
    const auto views = readAll(file);
    ASSERT_EQ(views.size(), 3U);
    EXPECT_LT((views[0].world_T_camera.translation - Eigen::Vector3d(0.5, 0, 0)).norm(), 1e-9);
    EXPECT_LT((views[1].world_T_camera.translation - Eigen::Vector3d(0.5, 0.5, 0)).norm(), 1e-9);
    EXPECT_LT((views[2].world_T_camera.translation - Eigen::Vector3d(0, 0.5, 0)).norm(), 1e-9);
}

TEST(Rawlog, PosesFromAFileAreOfTheCamera) {
    const TemporaryFolder folder;
    writeThree(folder / "a.rawlog");
    std::vector<TimedPose> poses;
    for (int i = 0; i < 3; ++i) {
        poses.push_back({i * kSecond, poseAt(10.0 + i)});
    }
    writeTum(folder / "a.tum", poses);
    const auto views = readAll(folder / "a.rawlog", {}, folder / "a.tum");
    ASSERT_EQ(views.size(), 3U);
    EXPECT_LT(distance(views[1].world_T_camera, poseAt(11)), 1e-9);

    RawlogOptions ofRobot;
    ofRobot.posesOf = RawlogOptions::FileOf::kRobot;
    const auto robot = readAll(folder / "a.rawlog", ofRobot, folder / "a.tum");
    EXPECT_LT(distance(robot.at(1).world_T_camera, poseAt(11) * forwardCamera()), 1e-9);
}

TEST(Rawlog, TheCamerasPoseOnTheRobotCanBeGiven) {
    const TemporaryFolder folder;
    const auto file = folder / "identity.rawlog";
    {
        mrpt::io::CFileGZOutputStream out(file.string());
        auto pair = pairAt(0);
        pair->cameraPose = mrpt::poses::CPose3DQuat();  // as MRPT's sample configurations leave it
        put(out, robotPose(0, 2));
        put(out, *pair);
    }
    RawlogOptions options;
    options.cameraXyz = {0, 0, 1};
    options.cameraYpr_deg = {-90, 0, -90};
    const auto view = readAll(file, options).at(0);
    EXPECT_LT(angleBetween(view.world_T_camera, forwardCamera()), 1e-9);
    EXPECT_LT((view.world_T_camera.translation - Eigen::Vector3d(2, 0, 1)).norm(), 1e-9);
    options.cameraXyz = {1, 2};
    EXPECT_THAT(messageOf<ConfigError>([&] { readAll(file, options); }), HasSubstr("camera_xyz"));
}

TEST(Rawlog, ASensorPoseOfARobotPoseMustBeExplained) {
    const TemporaryFolder folder;
    const auto file = folder / "sensor.rawlog";
    {
        mrpt::io::CFileGZOutputStream out(file.string());
        auto pose = robotPose(0, 2);
        pose.sensorPose = mrpt::poses::CPose3D(0.5, 0, 0, 0, 0, 0);
        put(out, pose);
        put(out, *pairAt(0));
    }
    EXPECT_THAT(messageOf<ConfigError>([&] { readAll(file); }), HasSubstr("robot_pose_of"));
    RawlogOptions options;
    options.robotPoseOf = RawlogOptions::PoseOf::kRobot;
    EXPECT_NEAR(readAll(file, options).at(0).world_T_camera.translation.x(), 2.0, 1e-12);
    options.robotPoseOf = RawlogOptions::PoseOf::kSensor;
    EXPECT_NEAR(readAll(file, options).at(0).world_T_camera.translation.x(), 1.5, 1e-12);
}

TEST(Rawlog, SelectsViews) {
    const TemporaryFolder folder;
    writeThree(folder / "a.rawlog");
    RawlogOptions options;
    options.firstView = 1;
    EXPECT_EQ(readAll(folder / "a.rawlog", options).size(), 2U);
    options = {};
    options.everyView = 2;
    RawlogReader reader(folder / "a.rawlog", options);
    EXPECT_EQ(reader.expectedViews(), 2U);
    const auto views = readAll(reader);
    ASSERT_EQ(views.size(), 2U);
    EXPECT_EQ(views[1].time_ns, 2 * kSecond);
    options.maxViews = 1;
    EXPECT_EQ(readAll(folder / "a.rawlog", options).size(), 1U);
    options.sensor = "left";
    EXPECT_THAT(messageOf<ConfigError>([&] { readAll(folder / "a.rawlog", options); }),
                HasSubstr("'stereo'"));
}

TEST(Rawlog, EverythingBeforeACutIsRead) {
    const TemporaryFolder folder;
    writeThree(folder / "whole.rawlog");
    const auto bytes = readFile(folder / "whole.rawlog");
    std::size_t most = 0;
    for (std::size_t tenth = 1; tenth < 10; ++tenth) {
        const auto file = folder.write("cut.rawlog", bytes.substr(0, bytes.size() * tenth / 10));
        std::size_t views = 0;
        try {
            RawlogReader reader(file, {});
            while (reader.next()) {
                ++views;
            }
            ADD_FAILURE() << "a file cut at " << tenth << "/10 was taken for a whole one";
        } catch (const RawlogError& e) {
            EXPECT_THAT(e.what(), HasSubstr("cut.rawlog"));
            EXPECT_THAT(e.what(), views > 0 ? HasSubstr("damaged after object") : HasSubstr(""));
        }
        EXPECT_GE(views, most);
        most = views;
    }
    EXPECT_EQ(most, 2U);
}

/// Not compressed, so that every byte is a place to cut at, also those where MRPT takes what is
/// left of an object for the end of the file.
TEST(Rawlog, ACutAtAnyByteIsNoticed) {
    const TemporaryFolder folder;
    std::vector<std::uint8_t> object;
    const auto pose = robotPose(kSecond, 1);
    mrpt::serialization::ObjectToOctetVector(&pose, object);
    const std::string bytes(object.begin(), object.end());
    for (std::size_t n = 1; n < bytes.size(); ++n) {
        const auto file = folder.write("cut.rawlog", bytes + bytes.substr(0, n));
        RawlogObjects objects(file);
        ASSERT_NE(objects.next(), nullptr);
        EXPECT_THAT(messageOf<RawlogError>([&] { objects.next(); }),
                    HasSubstr("damaged after object 1"))
            << "byte " << n << " of " << bytes.size();
    }
    RawlogObjects whole(folder.write("whole.rawlog", bytes + bytes));
    EXPECT_NE(whole.next(), nullptr);
    EXPECT_NE(whole.next(), nullptr);
    EXPECT_EQ(whole.next(), nullptr);
}

TEST(Rawlog, NamesTheObjectThatMakesNoSense) {
    const TemporaryFolder folder;
    const auto file = folder / "bad.rawlog";
    const auto errorOf = [&](const std::function<void(mrpt::io::CFileGZOutputStream&)>& write) {
        {
            mrpt::io::CFileGZOutputStream out(file.string());
            put(out, robotPose(0, 0));
            put(out, *pairAt(0));
            put(out, robotPose(kSecond, 1));
            write(out);
        }
        RawlogReader reader(file, {});
        EXPECT_TRUE(reader.next().has_value()) << "the sound view before is lost";
        return messageOf<RawlogError>([&] { reader.next(); });
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(errorOf([&](auto& out) { put(out, robotPose(2 * kSecond, nan)); }),
                ::testing::AllOf(HasSubstr("object 4"), HasSubstr("not finite")));
    EXPECT_THAT(errorOf([&](auto& out) {
                    auto pair = pairAt(kSecond);
                    pair->leftCamera.setIntrinsicParamsFromValues(nan, 100, 80, 60);
                    put(out, *pair);
                }),
                ::testing::AllOf(HasSubstr("object 4"), HasSubstr("calibration")));
    EXPECT_THAT(errorOf([&](auto& out) {
                    auto pair = pairAt(kSecond);
                    pair->imageRight = mrpt::img::CImage(100, 120, mrpt::img::CH_GRAY);
                    put(out, *pair);
                }),
                ::testing::AllOf(HasSubstr("object 4"), HasSubstr("100")));
    EXPECT_THAT(errorOf([&](auto& out) {
                    auto pair = pairAt(kSecond);
                    pair->cameraPose = mrpt::poses::CPose3DQuat(
                        0, 0, 0, mrpt::math::CQuaternionDouble(1, 0, 0, 0));
                    pair->cameraPose.quat().r(0.5);
                    put(out, *pair);
                }),
                ::testing::AllOf(HasSubstr("object 4"), HasSubstr("quaternion")));
    EXPECT_THAT(errorOf([&](auto& out) {
                    auto pair = pairAt(kSecond);
                    pair->hasImageRight = false;
                    put(out, *pair);
                }),
                ::testing::AllOf(HasSubstr("object 4"), HasSubstr("no right image")));
}

TEST(Rawlog, TimeDoesNotRunBackwards) {
    const TemporaryFolder folder;
    const auto file = folder / "back.rawlog";
    {
        mrpt::io::CFileGZOutputStream out(file.string());
        put(out, robotPose(0, 0));
        put(out, robotPose(kSecond, 0));
        put(out, *pairAt(kSecond));
        put(out, *pairAt(kSecond / 4));
    }
    RawlogReader reader(file, {});
    EXPECT_TRUE(reader.next().has_value());
    EXPECT_THAT(messageOf<RawlogError>([&] { reader.next(); }), HasSubstr("backwards, by 0.75 s"));
}

TEST(SimpleMap, MrptReadsItAndSoDoWe) {
    const TemporaryFolder folder;
    const auto file = folder / "keyframes.simplemap";
    SimpleMapWriter writer(file);
    for (int i = 0; i < 3; ++i) {
        writer.add(texturedPair(i * kSecond, poseAt(i), static_cast<std::uint32_t>(i) + 1));
    }
    writer.finish();

    mrpt::maps::CSimpleMap map;
    ASSERT_TRUE(map.loadFromFile(file.string()));
    EXPECT_EQ(map.size(), 3U);
    const auto views = readAll(file);
    ASSERT_EQ(views.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_LT(distance(views[i].world_T_camera, poseAt(static_cast<double>(i))), 1e-9);
        EXPECT_TRUE(samePixels(views[i].right,
                               texturedPair(0, {}, static_cast<std::uint32_t>(i) + 1).right));
    }
}

TEST(SimpleMap, AnEmptyOneIsWholeAndAnAbandonedOneLeavesNothing) {
    const TemporaryFolder folder;
    { SimpleMapWriter(folder / "empty.simplemap").finish(); }
    mrpt::maps::CSimpleMap map;
    EXPECT_TRUE(map.loadFromFile((folder / "empty.simplemap").string()));
    EXPECT_TRUE(map.empty());
    std::filesystem::remove(folder / "empty.simplemap");
    {
        SimpleMapWriter writer(folder / "never.simplemap");
        writer.add(texturedPair(0));
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(RawlogWriter, AnAbandonedOneLeavesItsWholeViewsToBeSalvaged) {
    const TemporaryFolder folder;
    { const RawlogWriter none(folder / "a.rawlog"); }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
    {
        RawlogWriter rawlog(folder / "a.rawlog");
        rawlog.write(texturedPair(0));
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "a.rawlog"));
    EXPECT_EQ(salvageRawlog(folder / "a.rawlog", true), 1U);
    EXPECT_TRUE(std::filesystem::exists(folder / "a.rawlog"));
    EXPECT_EQ(salvageRawlog(folder / "none.rawlog"), 0U);
    EXPECT_THROW(salvageRawlog(folder / "none.rawlog", true), FileError);
}

TEST(RawlogWriter, AFullDiskIsNoticed) {
    if (!std::filesystem::exists("/dev/full")) {
        GTEST_SKIP() << "no /dev/full here";
    }
    const TemporaryFolder folder;
    // The writer opens NAME.part: that leads to a device that is always full.
    std::filesystem::create_symlink("/dev/full", folder / "full.rawlog.part");
    RawlogWriter writer(folder / "full.rawlog");
    EXPECT_THAT(messageOf<FileError>([&] {
                    writer.write(texturedPair(0));
                    writer.finish();
                }),
                HasSubstr("full.rawlog"));
    EXPECT_FALSE(std::filesystem::exists(folder / "full.rawlog"));
}

}  // namespace
}  // namespace riftmap
