// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/rectifier.h"

#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DQuat.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

namespace riftmap {
namespace {

using mrpt::img::DistortionModel;
using mrpt::img::TCamera;
using mrpt::img::TStereoCamera;

bool isDistorted(const TCamera& camera) {
    return camera.distortion != DistortionModel::none &&
           std::any_of(camera.dist.begin(), camera.dist.end(), [](double k) { return k != 0; });
}

Pose rightInLeft(const TStereoCamera& camera) {
    return fromMrpt(mrpt::poses::CPose3D(mrpt::poses::CPose3DQuat(camera.rightCameraPose)));
}

void requireUsable(const TStereoCamera& camera) {
    for (const auto* c : {&camera.leftCamera, &camera.rightCamera}) {
        if (!(c->fx() > 0) || !(c->fy() > 0) || c->ncols == 0 || c->nrows == 0) {
            throw std::invalid_argument(
                "stereo calibration: a camera has fx = " + std::to_string(c->fx()) +
                ", fy = " + std::to_string(c->fy()) + ", size " + std::to_string(c->ncols) + " x " +
                std::to_string(c->nrows) + "; allowed: all > 0");
        }
    }
    const Pose right = rightInLeft(camera);
    if (!isValid(right) || !(right.translation.x() > 0)) {
        throw std::invalid_argument(
            "stereo calibration: right camera at x = " + std::to_string(right.translation.x()) +
            " m of the left one; allowed: > 0, with a finite pose");
    }
}

StereoCamera rectifiedCamera(const TStereoCamera& camera) {
    const TCamera& l = camera.leftCamera;
    return {.width = static_cast<int>(l.ncols),
            .height = static_cast<int>(l.nrows),
            .fx = l.fx(),
            .fy = l.fy(),
            .cx = l.cx(),
            .cy = l.cy(),
            .baseline = camera.rightCameraPose.x,
            .doffs = camera.rightCamera.cx() - l.cx()};
}

cv::Matx33d intrinsics(const TCamera& c) {
    return {c.fx(), 0, c.cx(), 0, c.fy(), c.cy(), 0, 0, 1};
}

/// k1 k2 t1 t2 k3 k4 k5 k6, as OpenCV orders them.
cv::Mat distortion(const TCamera& c) {
    if (!isDistorted(c)) {
        return cv::Mat::zeros(1, 8, CV_64F);
    }
    if (c.distortion != DistortionModel::plumb_bob) {
        throw std::invalid_argument(
            "stereo calibration: distortion model kannala_brandt (fisheye); allowed: none | "
            "plumb_bob");
    }
    cv::Mat k(1, 8, CV_64F);
    std::copy(c.dist.begin(), c.dist.end(), k.ptr<double>());
    return k;
}

cv::Matx33d toCv(const Eigen::Matrix3d& m) {
    return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
}

bool sameCalibration(const TStereoCamera& a, const TStereoCamera& b) {
    for (std::size_t i = 0; i < 7; ++i) {  // x y z, then the quaternion
        if (a.rightCameraPose[i] != b.rightCameraPose[i]) {
            return false;
        }
    }
    return a.leftCamera == b.leftCamera && a.rightCamera == b.rightCamera;
}

void requireSize(const cv::Mat& image, const TCamera& camera, const char* which) {
    if (image.cols != static_cast<int>(camera.ncols) ||
        image.rows != static_cast<int>(camera.nrows)) {
        throw std::invalid_argument(std::string(which) + " image is " + std::to_string(image.cols) +
                                    " x " + std::to_string(image.rows) + ", its calibration " +
                                    std::to_string(camera.ncols) + " x " +
                                    std::to_string(camera.nrows));
    }
}

}  // namespace

bool isRectified(const TStereoCamera& camera) {
    const TCamera& l = camera.leftCamera;
    const TCamera& r = camera.rightCamera;
    if (isDistorted(l) || isDistorted(r) || l.ncols != r.ncols || l.nrows != r.nrows) {
        return false;
    }
    constexpr double kPixels = 1e-3;
    if (std::abs(l.fx() - r.fx()) > kPixels || std::abs(l.fy() - r.fy()) > kPixels ||
        std::abs(l.cy() - r.cy()) > kPixels) {
        return false;
    }
    constexpr double kAngle = 1e-5;  // 0.01 px at a focal length of 1000 px
    const Pose right = rightInLeft(camera);
    return angleBetween(Pose(), right) < kAngle && right.translation.x() > 0 &&
           right.translation.tail<2>().norm() < kAngle * right.translation.x();
}

struct Rectifier::Maps {
    TStereoCamera source;
    StereoCamera camera;
    Pose raw_T_rectified;
    cv::Mat leftXy, leftWeights, rightXy, rightWeights;  ///< for cv::remap

    explicit Maps(const TStereoCamera& source);
};

Rectifier::Maps::Maps(const TStereoCamera& from) : source(from) {
    const Pose leftInRight = rightInLeft(from).inverse();
    const cv::Size size(static_cast<int>(from.leftCamera.ncols),
                        static_cast<int>(from.leftCamera.nrows));
    const cv::Matx33d kl = intrinsics(from.leftCamera), kr = intrinsics(from.rightCamera);
    const cv::Mat dl = distortion(from.leftCamera), dr = distortion(from.rightCamera);
    const cv::Vec3d t(leftInRight.translation.x(), leftInRight.translation.y(),
                      leftInRight.translation.z());
    cv::Matx33d rl, rr;
    cv::Matx34d pl, pr;
    cv::Mat q;
    // alpha 0: no pixel without an image; zero disparity at infinity.
    cv::stereoRectify(kl, dl, kr, dr, size, toCv(leftInRight.rotation), t, rl, rr, pl, pr, q,
                      cv::CALIB_ZERO_DISPARITY, 0, size);
    cv::initUndistortRectifyMap(kl, dl, rl, pl, size, CV_16SC2, leftXy, leftWeights);
    cv::initUndistortRectifyMap(kr, dr, rr, pr, size, CV_16SC2, rightXy, rightWeights);
    camera = {.width = size.width,
              .height = size.height,
              .fx = pl(0, 0),
              .fy = pl(1, 1),
              .cx = pl(0, 2),
              .cy = pl(1, 2),
              .baseline = -pr(0, 3) / pr(0, 0),
              .doffs = pr(0, 2) - pl(0, 2)};
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            raw_T_rectified.rotation(i, j) = rl(j, i);  // rl takes raw to rectified
        }
    }
}

Rectifier::Rectifier() = default;
Rectifier::~Rectifier() = default;

void Rectifier::rectify(const TStereoCamera& camera, const cv::Mat& left, const cv::Mat& right,
                        RectifiedPair& out) {
    requireUsable(camera);
    requireSize(left, camera.leftCamera, "left");
    requireSize(right, camera.rightCamera, "right");
    if (isRectified(camera)) {
        out = {left, right, rectifiedCamera(camera), Pose()};
        return;
    }
    if (!maps_ || !sameCalibration(camera, maps_->source)) {
        maps_ = std::make_unique<Maps>(camera);
    }
    cv::Mat rectifiedLeft, rectifiedRight;  // fresh: the last pair may still be in use
    cv::remap(left, rectifiedLeft, maps_->leftXy, maps_->leftWeights, cv::INTER_LINEAR);
    cv::remap(right, rectifiedRight, maps_->rightXy, maps_->rightWeights, cv::INTER_LINEAR);
    out = {rectifiedLeft, rectifiedRight, maps_->camera, maps_->raw_T_rectified};
}

}  // namespace riftmap
