// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/img/TStereoCamera.h>

#include <memory>
#include <opencv2/core/mat.hpp>

#include "riftmap/core/camera.h"
#include "riftmap/core/pose.h"

namespace riftmap {

/// True if the pair of this camera needs no rectification: neither camera is distorted, the right
/// one is turned by less than 1e-5 rad and lies on the x axis of the left one, and fx, fy, cy and
/// the sizes agree (cx may differ: that is StereoCamera::doffs).
bool isRectified(const mrpt::img::TStereoCamera& camera);

/// A rectified pair and what took it.
struct RectifiedPair {
    cv::Mat left, right;  ///< as the input: depth and channels; shared with it where already so
    StereoCamera camera;
    /// Pose of the rectified left camera in the frame of the raw left camera: a pure rotation.
    Pose raw_T_rectified;
};

/// Undistorts and rectifies raw stereo pairs (paper IX.B.1). The maps are made once for a camera
/// and kept until another camera comes. One object is used by one thread at a time.
class Rectifier {
 public:
    Rectifier();
    ~Rectifier();

    /// Throws std::invalid_argument where the calibration is unusable (no baseline, right camera
    /// left of the left one, focal length not positive, unknown distortion) or the images do not
    /// have the calibration's size.
    void rectify(const mrpt::img::TStereoCamera& camera, const cv::Mat& left, const cv::Mat& right,
                 RectifiedPair& out);

 private:
    struct Maps;
    std::unique_ptr<Maps> maps_;
};

}  // namespace riftmap
