// SPDX-License-Identifier: BSD-3-Clause
// Views of simple surfaces with exact depth.
#pragma once

#include <algorithm>
#include <functional>
#include <optional>

#include "riftmap/core/view.h"
#include "riftmap/graph/pixel_graph.h"

namespace riftmap::test {

inline StereoCamera smallCamera() {
    StereoCamera camera;
    camera.width = 256;
    camera.height = 192;
    camera.fx = camera.fy = 210;
    camera.cx = 127.5;
    camera.cy = 95.5;
    camera.baseline = 0.12;
    return camera;
}

/// `depthAlong(origin, direction)`: distance in lengths of the direction to the surface, if any.
inline View viewOf(const Pose& pose,
                   const std::function<std::optional<double>(const Eigen::Vector3d&,
                                                             const Eigen::Vector3d&)>& depthAlong,
                   int firstColumn = 0) {
    View view;
    view.camera = smallCamera();
    view.world_T_camera = pose;
    view.disparity.resize(view.camera.width, view.camera.height);
    view.disparity.firstColumn = firstColumn;
    view.image = cv::Mat(view.camera.height, view.camera.width, CV_8UC1, cv::Scalar(128));
    for (int row = 0; row < view.camera.height; ++row) {
        for (int column = firstColumn; column < view.camera.width; ++column) {
            const Eigen::Vector3d ray((column - view.camera.cx) / view.camera.fx,
                                      (row - view.camera.cy) / view.camera.fy, 1.0);
            if (const auto z = depthAlong(pose.translation, pose.rotation * ray)) {
                const std::size_t i = view.disparity.index(column, row);
                view.disparity.disparity[i] = static_cast<float>(view.camera.disparity(*z));
                view.disparity.sigma[i] = 0.05F;
            }
        }
    }
    return view;
}

/// The wall x = `at`, seen from smaller x.
inline std::function<std::optional<double>(const Eigen::Vector3d&, const Eigen::Vector3d&)> wall(
    double at) {
    return [at](const Eigen::Vector3d& origin,
                const Eigen::Vector3d& direction) -> std::optional<double> {
        if (direction.x() < 1e-9) {
            return std::nullopt;
        }
        return (at - origin.x()) / direction.x();
    };
}

/// Of a map that is asked for so finely [m]; the rest as it comes.
inline GraphOptions graphOptions(double targetResolution) {
    GraphOptions options;
    options.targetResolution = targetResolution;
    return options;
}

/// The inside of a box around the origin, from a place in it; half its edges.
inline double insideBox(const Eigen::Vector3d& half, const Eigen::Vector3d& origin,
                        const Eigen::Vector3d& direction) {
    double nearest = 100;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] != 0) {
            const double side = direction[axis] > 0 ? half[axis] : -half[axis];
            nearest = std::min(nearest, (side - origin[axis]) / direction[axis]);
        }
    }
    return nearest;
}

}  // namespace riftmap::test
