// SPDX-License-Identifier: BSD-3-Clause
#include "distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace riftmap {
namespace {

Eigen::Vector3d closestOnSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                 const Eigen::Vector3d& b) {
    const Eigen::Vector3d d = b - a;
    const double squared = d.squaredNorm();
    const double s = squared > 0 ? std::clamp((p - a).dot(d) / squared, 0.0, 1.0) : 0.0;
    return a + s * d;
}

/// True if the projection of p along the normal n lies inside the triangle.
bool projectsInside(const Eigen::Vector3d& p, const Triangle& t, const Eigen::Vector3d& n) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d& a = t[i];
        const Eigen::Vector3d& b = t[(i + 1) % 3];
        if (n.dot((b - a).cross(p - a)) < 0) {
            return false;
        }
    }
    return true;
}

}  // namespace

Eigen::Vector3d closestPoint(const Eigen::Vector3d& p, const Triangle& t) {
    const Eigen::Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]);
    const double squared = n.squaredNorm();
    if (squared > 0 && projectsInside(p, t, n)) {
        return p - n * (n.dot(p - t[0]) / squared);
    }
    Eigen::Vector3d best = t[0];
    double bestDistance = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d q = closestOnSegment(p, t[i], t[(i + 1) % 3]);
        const double distance = (q - p).squaredNorm();
        if (distance < bestDistance) {
            bestDistance = distance;
            best = q;
        }
    }
    return best;
}

double segmentDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d) {
    // Either the lines' common normal meets both segments, or an end of one is nearest.
    const Eigen::Vector3d u = b - a;
    const Eigen::Vector3d v = d - c;
    const Eigen::Vector3d w = a - c;
    const double uu = u.dot(u);
    const double uv = u.dot(v);
    const double vv = v.dot(v);
    const double determinant = uu * vv - uv * uv;
    if (determinant > 1e-12 * uu * vv) {
        const double s = (uv * v.dot(w) - vv * u.dot(w)) / determinant;
        const double t = (uu * v.dot(w) - uv * u.dot(w)) / determinant;
        if (s >= 0 && s <= 1 && t >= 0 && t <= 1) {
            return (w + s * u - t * v).norm();
        }
    }
    return std::min({(closestOnSegment(a, c, d) - a).norm(), (closestOnSegment(b, c, d) - b).norm(),
                     (closestOnSegment(c, a, b) - c).norm(),
                     (closestOnSegment(d, a, b) - d).norm()});
}

double segmentDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Triangle& t) {
    const Eigen::Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]);
    const double sideA = n.dot(a - t[0]);
    const double sideB = n.dot(b - t[0]);
    if (n.squaredNorm() > 0 && sideA * sideB <= 0 && sideA != sideB) {
        if (projectsInside(a + (b - a) * (sideA / (sideA - sideB)), t, n)) {
            return 0;
        }
    }
    double best = std::min((closestPoint(a, t) - a).norm(), (closestPoint(b, t) - b).norm());
    for (std::size_t i = 0; i < 3; ++i) {
        best = std::min(best, segmentDistance(a, b, t[i], t[(i + 1) % 3]));
    }
    return best;
}

}  // namespace riftmap
