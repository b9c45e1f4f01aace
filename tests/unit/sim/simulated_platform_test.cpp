// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/simulated_platform.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <functional>
#include <opencv2/core.hpp>

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;
using Level = NoiseOptions::Level;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

SimulationOptions smallRoom(Level level = Level::kN0) {
    SimulationOptions options;
    options.camera.width = 160;
    options.camera.height = 120;
    options.camera.f = 130;
    options.camera.numDisparities = 30;
    options.noise.level = level;
    return options;
}

std::string configError(const SimulationOptions& options) {
    try {
        makePlatform(options, 0);
    } catch (const ConfigError& error) {
        return error.what();
    } catch (const MeshError& error) {
        return error.what();
    }
    return "no error";
}

Pose shifted(const Pose& pose, const Point& by) {
    return {pose.rotation, pose.translation + by};
}

TEST(SimulatedPlatform, N0IsTheExactDepthInTheMeasuredRange) {
    SimulationOptions options = smallRoom();
    options.camera.farLimit = 3;
    const auto platform = makePlatform(options, 1);
    const StereoObservation view = platform->grab();
    ASSERT_TRUE(view.disparity);
    EXPECT_TRUE(view.right.empty());
    EXPECT_EQ(view.left.cols, 160);
    const DisparityImage& d = *view.disparity;
    EXPECT_EQ(d.firstColumn, 30);
    EXPECT_FLOAT_EQ(d.maxDisparity, 30);
    EXPECT_FLOAT_EQ(d.minDisparity, 130 * 0.12F / 3);
    const Truth truth = platform->renderer().truth(platform->pose());
    int valid = 0;
    int far = 0;
    for (int row = 0; row < d.height; ++row) {
        for (int column = 0; column < d.width; ++column) {
            const auto z = static_cast<double>(truth.depth.at<float>(row, column));
            const bool measured = column >= 30 && z <= 3 && z >= 130 * 0.12 / 30;
            far += z > 3 ? 1 : 0;
            ASSERT_EQ(d.valid(column, row), measured) << column << ',' << row << " at " << z;
            if (measured) {
                ASSERT_NEAR(view.camera.depth(static_cast<double>(d.at(column, row))), z, 1e-5 * z);
                ASSERT_EQ(d.sigma[d.index(column, row)], kExactSigma);
                ++valid;
            }
        }
    }
    EXPECT_GT(valid, 3000);
    EXPECT_GT(far, 1000);
}

TEST(SimulatedPlatform, N3HasNoiseOfItsSigmaAndNoHalfOccludedPixels) {
    SimulationOptions options = smallRoom(Level::kN3);
    options.noise.sigmaD = 0.25;
    const auto platform = makePlatform(options, 1);
    const DisparityImage noisy = *platform->grab().disparity;
    const DisparityImage again = *platform->grab().disparity;
    const Truth truth = platform->renderer().truth(platform->pose());
    double squares = 0;
    double sum = 0;
    int n = 0;
    int differing = 0;
    for (int row = 0; row < noisy.height; ++row) {
        for (int column = 0; column < noisy.width; ++column) {
            if (!noisy.valid(column, row)) {
                continue;
            }
            ASSERT_EQ(truth.halfOccluded.at<unsigned char>(row, column), 0);
            const auto z = static_cast<double>(truth.depth.at<float>(row, column));
            const double error =
                static_cast<double>(noisy.at(column, row)) - platform->camera().disparity(z);
            sum += error;
            squares += error * error;
            differing += noisy.at(column, row) != again.at(column, row) ? 1 : 0;
            EXPECT_EQ(noisy.sigma[noisy.index(column, row)], 0.25F);
            ++n;
        }
    }
    ASSERT_GT(n, 8000);
    EXPECT_NEAR(sum / n, 0, 0.01);
    EXPECT_NEAR(std::sqrt(squares / n), 0.25, 0.01);
    EXPECT_GT(differing, n * 9 / 10) << "every view has noise of its own";
}

TEST(SimulatedPlatform, N4IsARectifiedPairForAMatcher) {
    const auto platform = makePlatform(smallRoom(Level::kN4), 1);
    const StereoObservation view = platform->grab();
    EXPECT_FALSE(view.disparity);
    EXPECT_EQ(view.left.size(), view.right.size());
    EXPECT_EQ(view.left.type(), CV_8UC3);
    EXPECT_GT(cv::norm(view.left, view.right, cv::NORM_L1), 1e5);
}

TEST(SimulatedPlatform, MovesAndKeepsAccount) {
    const auto platform = makePlatform(smallRoom(), 1);
    const Pose start = platform->pose();
    const auto before = platform->state();
    platform->moveAlong({shifted(start, {0.2, 0, 0}), shifted(start, {0.2, 0.1, 0})});
    EXPECT_NEAR(platform->pathLength(), 0.3, 1e-12);
    EXPECT_TRUE(platform->pose().translation.isApprox(start.translation + Point(0.2, 0.1, 0)));
    EXPECT_EQ(platform->state().time_ns - before.time_ns, 300'000'000) << "1 m/s";
    EXPECT_EQ(platform->collisions(), 0);
}

TEST(SimulatedPlatform, CollisionsAreErrorsAndCounted) {
    const auto platform = makePlatform(smallRoom(), 1);
    const Pose start = platform->pose();  // (2.2, 2.3, 1.3)
    // Through the partition wall, though both ends are clear of it.
    const Pose beside{start.rotation, {2.2, 4.1, 1.3}};
    const Pose behind{start.rotation, {3.6, 4.1, 1.3}};
    ASSERT_FALSE(platform->rayCaster().closest(behind.translation, 0.2));
    EXPECT_THROW(platform->moveAlong({beside, behind}), CollisionError);
    EXPECT_EQ(platform->collisions(), 1);
    EXPECT_TRUE(platform->pose().translation.isApprox(beside.translation)) << "stays before it";
    // Out of the workspace, and nearer to the ceiling than the clearance.
    EXPECT_THROW(platform->moveAlong({shifted(start, {0, 0, 3})}), CollisionError);
    EXPECT_THROW(platform->moveAlong({shifted(start, {0, 0, 1.25})}), CollisionError);
    EXPECT_EQ(platform->collisions(), 3);
    EXPECT_NO_THROW(platform->moveAlong({start, shifted(start, {0, 0, 1.15})}));
}

TEST(SimulatedPlatform, StepsHaveALongest) {
    SimulationOptions options = smallRoom();
    options.platform.maxStep = 0.5;
    const auto platform = makePlatform(options, 1);
    const Pose start = platform->pose();
    EXPECT_THROW(platform->moveAlong({shifted(start, {0.3, 0, 0}), start}), std::invalid_argument);
    EXPECT_EQ(platform->pathLength(), 0) << "nothing moved";
    EXPECT_EQ(platform->collisions(), 0);
    EXPECT_NO_THROW(platform->moveAlong({shifted(start, {0.5, 0, 0})}));
}

TEST(SimulatedPlatform, SaysWhatItsDepthIsLike) {
    SimulationOptions options = smallRoom();
    for (const auto& [level, kind] :
         {std::pair(Level::kN0, DepthKind::kExact), std::pair(Level::kN3, DepthKind::kPixelwise),
          std::pair(Level::kN4, DepthKind::kMatched)}) {
        options.noise.level = level;
        EXPECT_EQ(makePlatform(options, 1)->limits().depthKind, kind);
    }
}

TEST(SimulatedPlatform, AGroundRobotPansAndTiltsAtItsHeight) {
    SimulationOptions options = smallRoom();
    options.platform.kind = PlatformLimits::Kind::kGroundPanTilt;
    const auto platform = makePlatform(options, 1);
    const Point p = platform->pose().translation;
    EXPECT_DOUBLE_EQ(platform->limits().maxHeight, 1.8);
    EXPECT_NO_THROW(platform->moveAlong({StartPose{p, 2.0, -0.9}.pose()}));
    EXPECT_THROW(platform->moveAlong({StartPose{p, 2.0, -1.3}.pose()}), std::invalid_argument);
    EXPECT_THROW(platform->moveAlong({StartPose{{p.x(), p.y(), 2.1}, 2.0, 0}.pose()}),
                 std::invalid_argument);
    Pose rolled = StartPose{p, 2.0, 0}.pose();
    rolled.rotation = rolled.rotation * Eigen::AngleAxisd(0.1, Point::UnitZ()).toRotationMatrix();
    EXPECT_THROW(platform->moveAlong({rolled}), std::invalid_argument);
    options.platform.start = {2.2, 2.3, 2.2, 0, 0};
    EXPECT_THAT(configError(options), HasSubstr("Platform.start: "));
}

TEST(SimulatedPlatform, GoesOnFromAStateWithTheSameViews) {
    for (const Level level : {Level::kN3, Level::kN4}) {
        const auto platform = makePlatform(smallRoom(level), 5);
        platform->grab();
        platform->moveAlong({shifted(platform->pose(), {0.1, 0, 0})});
        const auto state = platform->state();
        const StereoObservation expected = platform->grab();
        const auto other = makePlatform(smallRoom(level), 5);
        other->setState(state);
        const StereoObservation view = other->grab();
        EXPECT_EQ(view.time_ns, expected.time_ns);
        EXPECT_EQ(cv::norm(view.left, expected.left, cv::NORM_INF), 0);
        if (expected.disparity) {
            EXPECT_EQ(view.disparity->disparity, expected.disparity->disparity);
        }
        EXPECT_EQ(other->pathLength(), platform->pathLength());
    }
}

TEST(SimulatedPlatform, NamesWhatIsWrongOnOneLine) {
    std::vector<std::pair<std::string, std::string>> cases;
    const auto add = [&](const std::string& expected, const auto& change) {
        SimulationOptions options = smallRoom();
        change(options);
        cases.emplace_back(configError(options), expected);
    };
    add("none.ply: no such file", [](auto& o) { o.world.mesh = "none.ply"; });
    add("clearance asks for 0.2 m", [](auto& o) { o.platform.start = {2.75, 4, 1, 0, 0}; });
    add("inside the surface", [](auto& o) { o.platform.start = {2.91, 4, 1, 0, 0}; });
    add("outside the workspace", [](auto& o) { o.platform.start = {9, 4, 1, 0, 0}; });
    add("five numbers", [](auto& o) { o.platform.start = {1, 2, 3}; });
    add("3 start poses", [](auto& o) { o.platform.startIndex = 7; });
    add("outside the world", [](auto& o) {
        o.platform.boxMin = {20, 20, 0};
        o.platform.boxMax = {22, 22, 2};
    });
    add("is not below", [](auto& o) { o.platform.boxMin = {7, 0, 0}; });
    add("three numbers", [](auto& o) { o.platform.boxMin = {7, 0}; });
    for (const auto& [message, expected] : cases) {
        EXPECT_THAT(message, AllOf(HasSubstr(expected), Not(HasSubstr("\n"))));
    }
}

/// A closed room of 5 x 4 x 2.6 m as an OFF file, with a box of 0.8 m standing on its floor.
/// `turned(i)`: triangle i is turned round; unturned, fronts look out of the hull and the box.
std::string roomFile(const std::function<bool(int)>& turned) {
    const std::string file = testing::TempDir() + "riftmap_room.off";
    std::ofstream out(file);
    out << "OFF\n16 24 0\n";
    const double boxes[2][6] = {{0, 0, 0, 5, 4, 2.6}, {3, 1, 0, 3.8, 1.8, 0.8}};
    for (const auto& b : boxes) {
        for (int i = 0; i < 8; ++i) {
            out << b[(i & 1) != 0 ? 3 : 0] << ' ' << b[(i & 2) != 0 ? 4 : 1] << ' '
                << b[(i & 4) != 0 ? 5 : 2] << '\n';
        }
    }
    const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                              {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    for (int i = 0; i < 24; ++i) {
        const auto& f = faces[i % 12];
        const int first = i / 12 * 8;
        out << "3 " << first + f[0] << ' ' << first + f[turned(i) ? 2 : 1] << ' '
            << first + f[turned(i) ? 1 : 2] << '\n';
    }
    return file;
}

TEST(SimulatedPlatform, ABuildingMayBeWoundAsItLikesButABoxInItIsSolid) {
    SimulationOptions options = smallRoom();
    options.world.viewSpace = WorldOptions::ViewSpace::kInside;
    for (const auto& [name, turned] : std::vector<std::pair<const char*, std::function<bool(int)>>>{
             {"fronts into the room", [](int i) { return i < 12; }},
             {"fronts out of the building", [](int) { return false; }},
             {"box and hull inside out", [](int) { return true; }},
             {"every other triangle", [](int i) { return i % 2 == 0; }}}) {
        SCOPED_TRACE(name);
        options.world.mesh = roomFile(turned);
        options.platform.start = {1.5, 1.5, 1.3, 30, 0};
        EXPECT_EQ(configError(options), "no error");
        options.platform.start = {3.4, 1.4, 0.4, 0, 0};
        if (!turned(12) && !turned(13)) {
            EXPECT_THAT(configError(options), HasSubstr("inside the surface"));
        }
    }
}

TEST(SimulatedPlatform, AStartInsideASolidIsRefused) {
    const std::string file = testing::TempDir() + "solid_cube.obj";
    std::ofstream out(file);
    for (int i = 0; i < 8; ++i) {
        out << "v " << (i & 1) << ' ' << (i & 2) / 2 << ' ' << (i & 4) / 4 << '\n';
    }
    out << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    out.close();
    SimulationOptions options = smallRoom();
    options.world.mesh = file;
    EXPECT_EQ(configError(options), "no error");
    options.platform.start = {0.5, 0.5, 0.5, 0, 0};
    EXPECT_THAT(configError(options), HasSubstr("inside the surface"));
    options.platform.start = {-0.5, 0.5, 0.5, 0, 0};
    EXPECT_EQ(configError(options), "no error");
}

}  // namespace
}  // namespace riftmap
