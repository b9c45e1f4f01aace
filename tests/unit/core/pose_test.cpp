// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/pose.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include "riftmap/core/camera.h"

namespace riftmap {
namespace {

constexpr unsigned kSeed = 7;

Pose randomPose(std::mt19937& random) {
    std::normal_distribution<double> normal;
    Pose pose;
    pose.rotation =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
            .normalized()
            .toRotationMatrix();
    pose.translation = {normal(random), normal(random), normal(random)};
    return pose;
}

TEST(Pose, InverseUndoes) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    std::mt19937 random(kSeed);
    for (int i = 0; i < 100; ++i) {
        const Pose pose = randomPose(random);
        const Pose identity = pose * pose.inverse();
        EXPECT_TRUE(identity.rotation.isIdentity(1e-12));
        EXPECT_LT(identity.translation.norm(), 1e-12);
    }
}

TEST(Pose, SurvivesMrpt) {
    std::mt19937 random(kSeed);
    for (int i = 0; i < 100; ++i) {
        const Pose pose = randomPose(random);
        const Pose back = fromMrpt(toMrpt(pose));
        EXPECT_TRUE(back.rotation.isApprox(pose.rotation, 1e-12));
        EXPECT_TRUE(back.translation.isApprox(pose.translation, 1e-12));
    }
}

TEST(Pose, ForwardCameraOfMrptLooksAlongX) {
    constexpr double kQuarter = std::numbers::pi / 2;
    const Pose mrpt = fromMrpt(mrpt::poses::CPose3D(0, 0, 0, -kQuarter, 0, -kQuarter));
    const Pose ours = lookAt({0, 0, 0}, {1, 0, 0});
    EXPECT_TRUE(mrpt.rotation.isApprox(ours.rotation, 1e-12));
}

TEST(Pose, LookAtPutsTheTargetOnTheAxis) {
    std::mt19937 random(kSeed);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 100; ++i) {
        const Eigen::Vector3d eye(normal(random), normal(random), normal(random));
        const Eigen::Vector3d target(normal(random), normal(random), normal(random));
        const Pose pose = lookAt(eye, target);
        ASSERT_TRUE(isValid(pose));
        const Eigen::Vector3d seen = pose.inverse() * target;
        EXPECT_NEAR(seen.x(), 0, 1e-12);
        EXPECT_NEAR(seen.y(), 0, 1e-12);
        EXPECT_GT(seen.z(), 0);
        EXPECT_LE(pose.rotation.col(1).z(), 1e-12) << "image down must not point up";
    }
    EXPECT_TRUE(isValid(lookAt({0, 0, 1}, {0, 0, 0}))) << "straight down";
}

TEST(Pose, InterpolatesEndsAndMiddle) {
    std::mt19937 random(kSeed);
    const Pose a = randomPose(random);
    const Pose b = randomPose(random);
    EXPECT_LT(angleBetween(interpolate(a, b, 0), a), 1e-7);
    EXPECT_LT(angleBetween(interpolate(a, b, 1), b), 1e-7);
    const Pose middle = interpolate(a, b, 0.5);
    EXPECT_NEAR(angleBetween(a, middle), angleBetween(middle, b), 1e-9);
    EXPECT_TRUE(middle.translation.isApprox((a.translation + b.translation) / 2, 1e-12));
}

TEST(Pose, NotANumberIsInvalid) {
    Pose pose;
    EXPECT_TRUE(isValid(pose));
    pose.translation.x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(isValid(pose));
    pose = {};
    pose.rotation *= 1.01;
    EXPECT_FALSE(isValid(pose));
    pose.rotation = Eigen::Vector3d(1, 1, -1).asDiagonal();
    EXPECT_FALSE(isValid(pose)) << "a mirror is no rotation";
}

// Eq. (1) and eq. (4) are inverse to each other, with principal point and Middlebury's doffs.
TEST(Camera, ProjectUndoesBackProject) {
    StereoCamera camera{.width = 741,
                        .height = 500,
                        .fx = 994.978,
                        .fy = 990.0,
                        .cx = 311.193,
                        .cy = 254.877,
                        .baseline = 0.193001,
                        .doffs = 31.086};
    validate(camera);
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> uniform(1, 100);
    for (int i = 0; i < 100; ++i) {
        const double column = uniform(random), row = uniform(random), d = uniform(random);
        const Eigen::Vector3d p = camera.backProject(column, row, d);
        EXPECT_NEAR(camera.project(p).x(), column, 1e-9);
        EXPECT_NEAR(camera.project(p).y(), row, 1e-9);
        EXPECT_NEAR(camera.disparity(p.z()), d, 1e-9);
        // The right camera sees the point d pixels farther left.
        const Eigen::Vector3d inRight = p - Eigen::Vector3d(camera.baseline, 0, 0);
        EXPECT_NEAR(camera.project(inRight).x() + camera.doffs, column - d, 1e-9);
    }
}

TEST(Camera, DepthSigmaIsTheDerivativeOfDepth) {
    const StereoCamera camera{
        .width = 512, .height = 384, .fx = 420, .fy = 420, .cx = 256, .cy = 192, .baseline = 0.12};
    const double z = 2.0, step = 1e-6;
    const double d = camera.disparity(z);
    const double slope = (camera.depth(d) - camera.depth(d + step)) / step;
    EXPECT_NEAR(camera.depthSigma(z, 1.0), slope, 1e-4);
}

TEST(Camera, NamesTheBadField) {
    StereoCamera camera{.width = 10, .height = 10, .fx = 1, .fy = 1, .baseline = 0};
    try {
        validate(camera);
        FAIL();
    } catch (const std::invalid_argument& e) {
        EXPECT_NE(std::string(e.what()).find("baseline"), std::string::npos);
    }
}

}  // namespace
}  // namespace riftmap
