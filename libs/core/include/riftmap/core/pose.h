// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/poses/CPose3D.h>

#include <Eigen/Core>

namespace riftmap {

/// Rigid motion x_a = rotation * x_b + translation, written `a_T_b`. Metres.
///
/// Only 3-vectors and 3x3 matrices inside: their layout does not depend on compiler flags
/// (fixed-size Eigen types of 16 bytes and more do).
struct Pose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal, det +1
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< [m]

    Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return rotation * x + translation; }
    Pose operator*(const Pose& b) const {
        return {rotation * b.rotation, rotation * b.translation + translation};
    }
    Pose inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
};

/// True if every number is finite and the rotation is orthonormal within 1e-6.
bool isValid(const Pose& pose);

Pose fromMrpt(const mrpt::poses::CPose3D& pose);
mrpt::poses::CPose3D toMrpt(const Pose& pose);

/// Pose of a camera (x right, y down, z forward) at `eye` that looks at `target` with its y axis
/// as far down (against `up`) as that allows; where the view is along `up`, towards the x axis.
/// World frame: z up by default.
Pose lookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
            const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ());

/// Translation linearly, rotation by slerp; s in [0, 1].
Pose interpolate(const Pose& a, const Pose& b, double s);

/// Angle of the rotation that takes a to b [rad], in [0, pi].
double angleBetween(const Pose& a, const Pose& b);

}  // namespace riftmap
