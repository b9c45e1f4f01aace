// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <vector>

#include "riftmap/core/camera.h"
#include "riftmap/core/pose.h"
#include "riftmap/core/view.h"

namespace riftmap {

/// Where depth comes from, and what can be said of it.
enum class DepthKind {
    /// Every pixel that meets a surface within the range is measured, without noise: one without
    /// depth shows that there is none.
    kExact,
    /// Each pixel by itself, with noise, where both cameras see: as good at flat angles, and not
    /// misled by surface nearer than the range.
    kPixelwise,
    /// By windows that are matched, which both mislead.
    kMatched,
};

/// What the thing that carries the camera can do. World frame, metres, radians.
struct PlatformLimits {
    enum class Kind {
        kFreeFlying,     ///< any position in the box, any direction of view
        kGroundPanTilt,  ///< drives on the ground; the camera keeps its horizon level
    };
    Kind kind = Kind::kFreeFlying;
    Eigen::Vector3d boxMin = Eigen::Vector3d::Constant(-1e3);  ///< workspace for the camera [m]
    Eigen::Vector3d boxMax = Eigen::Vector3d::Constant(1e3);   ///< [m]
    double clearance = 0.2;    ///< least distance from the camera to any surface [m], >= 0
    double maxStep = 10.0;     ///< longest path between two views [m], > 0
    double minHeight = -1e3;   ///< of the camera above the ground z = 0 [m] (ground kind)
    double maxHeight = 1e3;    ///< [m] (ground kind)
    double minTilt = -1.5708;  ///< of the view above the horizon [rad]
    double maxTilt = 1.5708;   ///< [rad]
    double nearLimit = 0.0;    ///< surfaces nearer than this are not measured [m]
    double farLimit = 1e3;     ///< nor those farther [m]
    DepthKind depthKind = DepthKind::kMatched;  ///< what the camera's depth is like
};

/// A path that touches a surface or leaves the workspace.
class CollisionError : public std::runtime_error {
 public:
    using std::runtime_error::runtime_error;
};

/// A camera that can be moved. Not thread-safe.
class CameraPlatform {
 public:
    virtual ~CameraPlatform() = default;

    virtual StereoCamera camera() const = 0;
    virtual PlatformLimits limits() const = 0;
    /// Pose of the left camera's optical frame in the map frame.
    virtual Pose pose() const = 0;
    /// Moves through the poses in order, straight from one to the next. Throws CollisionError
    /// where a swept segment comes nearer than the clearance to a surface or leaves the box.
    virtual void moveAlong(const std::vector<Pose>& path) = 0;
    /// Takes a view from the present pose.
    virtual StereoObservation grab() = 0;
};

}  // namespace riftmap
