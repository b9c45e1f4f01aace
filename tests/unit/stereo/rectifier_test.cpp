// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/rectifier.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DQuat.h>

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>
#include <string>

namespace riftmap {
namespace {

using mrpt::img::TCamera;
using mrpt::img::TStereoCamera;

TCamera pinhole(double f, double cx, double cy) {
    TCamera c;
    c.ncols = 320;
    c.nrows = 240;
    c.setIntrinsicParamsFromValues(f, f, cx, cy);
    return c;
}

TStereoCamera rectifiedRig() {
    TStereoCamera s;
    s.leftCamera = pinhole(300, 160, 120);
    s.rightCamera = pinhole(300, 165, 120);
    s.rightCameraPose = mrpt::math::TPose3DQuat(0.1, 0, 0, 1, 0, 0, 0);
    return s;
}

mrpt::math::TPose3DQuat turned(double x, double y, double z, double yaw, double pitch,
                               double roll) {
    return mrpt::poses::CPose3DQuat(mrpt::poses::CPose3D(x, y, z, yaw, pitch, roll)).asTPose();
}

TEST(IsRectified, LooksAtBothCameras) {
    EXPECT_TRUE(isRectified(rectifiedRig()));
    TStereoCamera s = rectifiedRig();
    s.rightCamera.setDistortionPlumbBob(-0.1, 0, 0, 0);
    EXPECT_FALSE(isRectified(s)) << "the right camera is distorted";
    s = rectifiedRig();
    s.leftCamera.setDistortionPlumbBob(0, 0, 1e-4, 0);
    EXPECT_FALSE(isRectified(s)) << "the left camera is distorted";
    s = rectifiedRig();
    s.rightCameraPose = turned(0.1, 0, 0, 0, 0, 0.001);
    EXPECT_FALSE(isRectified(s)) << "turned";
    s = rectifiedRig();
    s.rightCameraPose.y = 0.001;
    EXPECT_FALSE(isRectified(s)) << "shifted down";
    s = rectifiedRig();
    s.rightCamera.fy(301);
    EXPECT_FALSE(isRectified(s)) << "another focal length";
    s = rectifiedRig();
    s.rightCamera.cy(121);
    EXPECT_FALSE(isRectified(s)) << "another row";
}

TEST(Rectifier, LeavesARectifiedPairAlone) {
    const cv::Mat left(240, 320, CV_8UC1, cv::Scalar(1)), right(240, 320, CV_8UC1, cv::Scalar(2));
    Rectifier rectifier;
    RectifiedPair pair;
    rectifier.rectify(rectifiedRig(), left, right, pair);
    EXPECT_EQ(pair.left.data, left.data);
    EXPECT_EQ(pair.right.data, right.data);
    EXPECT_EQ(pair.camera.fx, 300);
    EXPECT_EQ(pair.camera.baseline, 0.1);
    EXPECT_EQ(pair.camera.doffs, 5);
    EXPECT_TRUE(pair.raw_T_rectified.rotation.isIdentity());
}

/// Points in space, seen by the raw cameras, must land on one row with the disparity of their
/// depth. The images hold one bright dot each.
TEST(Rectifier, PutsPointsOnOneRow) {
    TStereoCamera s = rectifiedRig();
    s.rightCamera = pinhole(305, 158, 118);
    s.rightCameraPose = turned(0.1, 0.004, -0.003, 0.01, -0.015, 0.02);
    s.leftCamera.setDistortionPlumbBob(-0.2, 0.05, 0.001, -0.001);
    s.rightCamera.setDistortionPlumbBob(-0.18, 0.04, 0, 0.001);
    const Pose left_T_right =
        fromMrpt(mrpt::poses::CPose3D(mrpt::poses::CPose3DQuat(s.rightCameraPose)));
    const auto dot = [](const TCamera& c, const Eigen::Vector3d& p) {
        const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
        const double radial = 1 + c.k1() * r2 + c.k2() * r2 * r2;
        const double u = x * radial + 2 * c.p1() * x * y + c.p2() * (r2 + 2 * x * x);
        const double v = y * radial + c.p1() * (r2 + 2 * y * y) + 2 * c.p2() * x * y;
        cv::Mat image(240, 320, CV_8UC1);
        for (int row = 0; row < 240; ++row) {
            for (int col = 0; col < 320; ++col) {
                const double dx = col - (c.fx() * u + c.cx()), dy = row - (c.fy() * v + c.cy());
                image.at<std::uint8_t>(row, col) = static_cast<std::uint8_t>(
                    std::lround(250 * std::exp(-(dx * dx + dy * dy) / 8)));
            }
        }
        return image;
    };
    const auto centre = [](const cv::Mat& image) {
        double sum = 0, x = 0, y = 0;
        for (int row = 0; row < image.rows; ++row) {
            for (int col = 0; col < image.cols; ++col) {
                const double w = image.at<std::uint8_t>(row, col);
                sum += w;
                x += w * col;
                y += w * row;
            }
        }
        return Eigen::Vector2d(x / sum, y / sum);
    };
    Rectifier rectifier;
    for (const Eigen::Vector3d& p :
         {Eigen::Vector3d(0.1, 0.05, 1.5), Eigen::Vector3d(-0.3, 0.25, 2),
          Eigen::Vector3d(0.6, -0.4, 2.5)}) {
        RectifiedPair pair;
        rectifier.rectify(s, dot(s.leftCamera, p), dot(s.rightCamera, left_T_right.inverse() * p),
                          pair);
        const Eigen::Vector2d l = centre(pair.left), r = centre(pair.right);
        EXPECT_NEAR(l.y(), r.y(), 0.15);
        const Eigen::Vector3d back =
            pair.raw_T_rectified * pair.camera.backProject(l.x(), l.y(), l.x() - r.x());
        EXPECT_LT((back - p).norm(), 0.02 * p.norm());
    }
}

TEST(Rectifier, SaysWhatIsWrong) {
    Rectifier rectifier;
    RectifiedPair pair;
    const cv::Mat image(240, 320, CV_8UC1, cv::Scalar(1)), small(100, 320, CV_8UC1, cv::Scalar(1));
    EXPECT_THROW(rectifier.rectify(rectifiedRig(), image, small, pair), std::invalid_argument);
    TStereoCamera s = rectifiedRig();
    s.rightCameraPose.x = -0.1;
    EXPECT_THROW(rectifier.rectify(s, image, image, pair), std::invalid_argument);
    s = rectifiedRig();
    s.rightCamera.fx(0);
    EXPECT_THROW(rectifier.rectify(s, image, image, pair), std::invalid_argument);
}

}  // namespace
}  // namespace riftmap
