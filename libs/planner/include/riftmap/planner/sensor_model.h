// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "riftmap/core/camera.h"
#include "riftmap/core/platform.h"
#include "riftmap/core/pose.h"
#include "riftmap/core/view.h"

namespace riftmap {

/// What a view will be able to measure: the true field of view and the range in depth.
struct SensorModel {
    StereoCamera camera;
    int firstColumn = 0;        ///< columns left of it have no partner in the right image [px]
    double nearLimit = 0;       ///< depth z [m]; nearer surfaces are not measured
    double farLimit = 1e3;      ///< depth z [m]; nor are those farther
    double sigmaDisparity = 0;  ///< median of the valid pixels [px]
    double clearance = 0;       ///< around the camera there is nothing nearer than this [m]
    DepthKind depthKind = DepthKind::kMatched;  ///< of the platform

    bool exactDepth() const { return depthKind == DepthKind::kExact; }
    bool matched() const { return depthKind == DepthKind::kMatched; }

    /// As the last view was, within the platform's range.
    static SensorModel of(const View& view, const PlatformLimits& limits);

    /// Area of a plane across the optical axis, so many metres away, that fills the left image
    /// [m^2]: its first columns, too, for it is a measure of scale.
    double areaSeenAt(double depth) const;

    /// Largest depth [m] at which one view measures as finely (pixel spacing) and as accurately
    /// (sigma_z <= resolution / 2) as asked; within the range.
    double goodDepth(double resolution) const;
    /// Share of surface first seen at this depth that the map has within `resolution` [m] of where
    /// it is: for noise that is Gaussian along the ray.
    double shareWithin(double resolution, double depth) const;
    /// Camera at `eye` with a level horizon and `target` in the middle of the true field of view
    /// (the part of the image that has a partner).
    Pose lookingAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) const;
};

}  // namespace riftmap
