// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace riftmap {

/// A rectified stereo camera: two pinholes with parallel axes, the right one `baseline` metres
/// along +x of the left one. Camera frame: x right, y down, z forward; pixel centres at integer
/// coordinates (column c, row r), as in OpenCV.
struct StereoCamera {
    int width = 0;          ///< [px]
    int height = 0;         ///< [px]
    double fx = 0, fy = 0;  ///< focal lengths [px], > 0
    double cx = 0, cy = 0;  ///< principal point of the left camera [px]
    double baseline = 0;    ///< [m], > 0
    /// Principal point of the right camera minus that of the left one along the row [px].
    /// Disparity of a point at infinity is -doffs (Middlebury 2014: d = f B / z - doffs).
    double doffs = 0;

    /// z [m] of a pixel with this disparity [px]; infinite or negative where none exists.
    double depth(double disparity) const { return fx * baseline / (disparity + doffs); }
    /// Disparity [px] of a point at depth z [m].
    double disparity(double z) const { return fx * baseline / z - doffs; }

    /// Paper eq. (1), with the principal point: position in the camera frame [m].
    Eigen::Vector3d backProject(double column, double row, double disparity) const {
        const double z = depth(disparity);
        return {(column - cx) * z / fx, (row - cy) * z / fy, z};
    }
    /// Paper eq. (4), with the principal point: (column, row) of a point in the camera frame with
    /// z > 0.
    Eigen::Vector2d project(const Eigen::Vector3d& p) const {
        return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy};
    }
    /// Standard deviation of z [m] from that of the disparity [px]: z^2 sigma_d / (f b).
    double depthSigma(double z, double sigmaDisparity) const {
        return z * z * sigmaDisparity / (fx * baseline);
    }
};

/// Throws std::invalid_argument that names the first field outside its range.
void validate(const StereoCamera& camera);

}  // namespace riftmap
