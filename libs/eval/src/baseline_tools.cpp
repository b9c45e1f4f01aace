// SPDX-License-Identifier: BSD-3-Clause
#include "baseline_tools.h"

#include <algorithm>
#include <cmath>

namespace riftmap {

Eigen::AlignedBox3d workspace(const PlatformLimits& limits) {
    Eigen::AlignedBox3d box(limits.boxMin, limits.boxMax);
    if (limits.kind == PlatformLimits::Kind::kGroundPanTilt) {
        box.min().z() = std::max(box.min().z(), limits.minHeight);
        box.max().z() = std::min(box.max().z(), limits.maxHeight);
    }
    return box;
}

Pose viewOf(const PlatformLimits& limits, const Eigen::Vector3d& place,
            const Eigen::Vector3d& direction) {
    Eigen::Vector3d d = direction.normalized();
    if (limits.kind == PlatformLimits::Kind::kGroundPanTilt) {
        const double tilt =
            std::clamp(std::asin(std::clamp(d.z(), -1.0, 1.0)), limits.minTilt, limits.maxTilt);
        const double yaw = std::atan2(d.y(), d.x());
        d = {std::cos(tilt) * std::cos(yaw), std::cos(tilt) * std::sin(yaw), std::sin(tilt)};
    }
    return lookAt(place, place + d);
}

std::optional<std::vector<Pose>> pathTo(const BaselineState& state, const Pose& view,
                                        std::size_t maxNodes) {
    const auto way = findWay(state, state.pose.translation, view.translation, 0.25, maxNodes);
    if (!way) {
        return std::nullopt;
    }
    std::vector<Pose> path;
    for (std::size_t i = 0; i < way->size(); ++i) {
        const double s = static_cast<double>(i + 1) / static_cast<double>(way->size());
        Pose pose = interpolate(state.pose, view, s);
        if (state.limits.kind == PlatformLimits::Kind::kGroundPanTilt) {
            pose = viewOf(state.limits, (*way)[i], pose.rotation.col(2));
        }
        pose.translation = (*way)[i];
        path.push_back(pose);
    }
    path.back() = view;
    if (pathLength(state.pose, path) > state.limits.maxStep) {
        return std::nullopt;
    }
    return path;
}

bool inView(const BaselineState& state, const Pose& view, const Eigen::Vector3d& place) {
    const Eigen::Vector3d p = view.inverse() * place;
    if (p.z() < state.limits.nearLimit || p.z() > state.limits.farLimit) {
        return false;
    }
    const Eigen::Vector2d pixel = state.camera.project(p);
    return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < state.camera.width &&
           pixel.y() < state.camera.height;
}

double pathLength(const Pose& from, const std::vector<Pose>& path) {
    double sum = 0;
    Eigen::Vector3d here = from.translation;
    for (const Pose& p : path) {
        sum += (p.translation - here).norm();
        here = p.translation;
    }
    return sum;
}

double uniform(std::mt19937_64& random) {
    return static_cast<double>(random() >> 11) * 0x1p-53;
}

Eigen::Vector3d randomIn(const Eigen::AlignedBox3d& box, std::mt19937_64& random) {
    const double x = uniform(random);
    const double y = uniform(random);
    const double z = uniform(random);
    return box.min() + Eigen::Vector3d(x, y, z).cwiseProduct(box.sizes());
}

Eigen::Vector3d randomDirection(std::mt19937_64& random) {
    const double z = 2 * uniform(random) - 1;
    const double a = 6.283185307179586 * uniform(random);
    const double r = std::sqrt(1 - z * z);
    return {r * std::cos(a), r * std::sin(a), z};
}

std::vector<Eigen::Vector3d> shortTour(const Eigen::Vector3d& start,
                                       std::vector<Eigen::Vector3d> places) {
    Eigen::Vector3d here = start;
    for (auto next = places.begin(); next != places.end(); ++next) {
        const auto nearest =
            std::min_element(next, places.end(), [&](const auto& a, const auto& b) {
                return (a - here).squaredNorm() < (b - here).squaredNorm();
            });
        std::iter_swap(next, nearest);
        here = *next;
    }
    const auto at = [&](std::size_t i) { return i == 0 ? start : places[i - 1]; };
    const std::size_t n = places.size();
    for (bool better = true; better;) {
        better = false;
        for (std::size_t i = 1; i <= n; ++i) {
            for (std::size_t j = i + 1; j <= n; ++j) {
                // Turning i..j round changes its two outer legs; the tour need not come back.
                const double before =
                    (at(i) - at(i - 1)).norm() + (j < n ? (at(j + 1) - at(j)).norm() : 0.0);
                const double after =
                    (at(j) - at(i - 1)).norm() + (j < n ? (at(j + 1) - at(i)).norm() : 0.0);
                if (after < before - 1e-9) {
                    std::reverse(places.begin() + static_cast<std::ptrdiff_t>(i) - 1,
                                 places.begin() + static_cast<std::ptrdiff_t>(j));
                    better = true;
                }
            }
        }
    }
    return places;
}

}  // namespace riftmap
