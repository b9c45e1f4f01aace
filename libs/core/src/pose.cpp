// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/pose.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace riftmap {

bool isValid(const Pose& pose) {
    const Eigen::Matrix3d gram = pose.rotation * pose.rotation.transpose();
    return pose.rotation.allFinite() && pose.translation.allFinite() &&
           (gram - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
           pose.rotation.determinant() > 0;
}

Pose fromMrpt(const mrpt::poses::CPose3D& pose) {
    Pose out;
    const auto& rotation = pose.getRotationMatrix();
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
            out.rotation(r, c) = rotation(r, c);
        }
        out.translation[r] = pose[static_cast<unsigned>(r)];
    }
    return out;
}

mrpt::poses::CPose3D toMrpt(const Pose& pose) {
    mrpt::math::CMatrixDouble33 rotation;
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
            rotation(r, c) = pose.rotation(r, c);
        }
    }
    mrpt::math::CVectorFixedDouble<3> translation;
    for (int i = 0; i < 3; ++i) {
        translation[i] = pose.translation[i];
    }
    return mrpt::poses::CPose3D(rotation, translation);
}

Pose lookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& up) {
    const Eigen::Vector3d forward = (target - eye).normalized();
    Eigen::Vector3d right = forward.cross(up);
    if (right.norm() < 1e-6) {
        right = forward.cross(Eigen::Vector3d::UnitX());
    }
    if (right.norm() < 1e-6) {  // `up` itself is the x axis
        right = forward.cross(Eigen::Vector3d::UnitY());
    }
    right.normalize();
    Pose pose;
    pose.rotation.col(0) = right;
    pose.rotation.col(1) = forward.cross(right);
    pose.rotation.col(2) = forward;
    pose.translation = eye;
    return pose;
}

Pose interpolate(const Pose& a, const Pose& b, double s) {
    const Eigen::Quaterniond qa(a.rotation);
    const Eigen::Quaterniond qb(b.rotation);
    Pose out;
    out.rotation = qa.slerp(s, qb).normalized().toRotationMatrix();
    out.translation = (1 - s) * a.translation + s * b.translation;
    return out;
}

double angleBetween(const Pose& a, const Pose& b) {
    return Eigen::Quaterniond(a.rotation).angularDistance(Eigen::Quaterniond(b.rotation));
}

}  // namespace riftmap
