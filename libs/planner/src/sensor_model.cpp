// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/sensor_model.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace riftmap {

SensorModel SensorModel::of(const View& view, const PlatformLimits& limits) {
    SensorModel model;
    model.camera = view.camera;
    model.firstColumn = view.disparity.firstColumn;
    model.nearLimit = limits.nearLimit;
    model.clearance = limits.clearance;
    model.depthKind = limits.depthKind;
    if (std::isfinite(view.disparity.maxDisparity)) {
        model.nearLimit = std::max(
            model.nearLimit, view.camera.depth(static_cast<double>(view.disparity.maxDisparity)));
    }
    model.farLimit = limits.farLimit;
    const double least = static_cast<double>(view.disparity.minDisparity) + view.camera.doffs;
    if (least > 0) {
        model.farLimit = std::min(
            model.farLimit, view.camera.depth(static_cast<double>(view.disparity.minDisparity)));
    }
    std::vector<float> sigma;
    for (std::size_t i = 0; i < view.disparity.sigma.size(); i += 17) {
        // A depth that is not known within a third of itself is no surface.
        if (std::isfinite(view.disparity.disparity[i]) &&
            3.0F * view.disparity.sigma[i] <
                view.disparity.disparity[i] + static_cast<float>(view.camera.doffs)) {
            sigma.push_back(view.disparity.sigma[i]);
        }
    }
    if (!sigma.empty()) {
        const auto middle = sigma.begin() + static_cast<std::ptrdiff_t>(sigma.size() / 2);
        std::nth_element(sigma.begin(), middle, sigma.end());
        model.sigmaDisparity = static_cast<double>(*middle);
    }
    return model;
}

double SensorModel::areaSeenAt(double depth) const {
    return (camera.width * depth / camera.fx) * (camera.height * depth / camera.fy);
}

double SensorModel::goodDepth(double resolution) const {
    double depth = std::min(farLimit, 0.8 * resolution * camera.fx);
    if (sigmaDisparity > 0) {
        depth = std::min(depth,
                         std::sqrt(resolution / 2 * camera.fx * camera.baseline / sigmaDisparity));
    }
    return std::max(depth, 1.15 * nearLimit);
}

double SensorModel::shareWithin(double resolution, double depth) const {
    const double sigma = camera.depthSigma(depth, sigmaDisparity);
    return sigma > 0 ? std::erf(resolution / (std::sqrt(2.0) * sigma)) : 1.0;
}

Pose SensorModel::lookingAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) const {
    const Eigen::Vector3d d = target - eye;
    const double level = std::hypot(d.x(), d.y());
    const double middle = (firstColumn + camera.width - 1) / 2.0;
    const double right = std::atan2(middle - camera.cx, camera.fx);
    const double elevation = std::atan2(d.z(), level);
    // Turning about the vertical moves the image less the steeper the view is.
    const double turn = std::cos(elevation) > 0.35 ? right / std::cos(elevation) : 0.0;
    const double azimuth = std::atan2(d.y(), d.x()) + turn;
    const Eigen::Vector3d axis(std::cos(elevation) * std::cos(azimuth),
                               std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    return lookAt(eye, eye + axis);
}

}  // namespace riftmap
