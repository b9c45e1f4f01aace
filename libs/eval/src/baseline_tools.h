// SPDX-License-Identifier: BSD-3-Clause
// What the baselines share.
#pragma once

#include <random>

#include "riftmap/eval/baselines.h"

namespace riftmap {

/// Where the camera may be, the range of heights of a ground platform included.
Eigen::AlignedBox3d workspace(const PlatformLimits& limits);

/// A pose that looks along `direction` as far as the platform can tilt, horizon level.
Pose viewOf(const PlatformLimits& limits, const Eigen::Vector3d& place,
            const Eigen::Vector3d& direction);

/// The poses on the way to a view, turned towards it evenly. Nothing if there is no way or it is
/// longer than the largest step.
std::optional<std::vector<Pose>> pathTo(const BaselineState& state, const Pose& view,
                                        std::size_t maxNodes);

/// Whether a place is within the image and the range of a view.
bool inView(const BaselineState& state, const Pose& view, const Eigen::Vector3d& place);

double pathLength(const Pose& from, const std::vector<Pose>& path);  ///< [m]

double uniform(std::mt19937_64& random);  ///< in [0, 1)
Eigen::Vector3d randomIn(const Eigen::AlignedBox3d& box, std::mt19937_64& random);
Eigen::Vector3d randomDirection(std::mt19937_64& random);

/// The places in an order of small length from `start` on: the nearest next, then improved by
/// turning parts round while that helps.
std::vector<Eigen::Vector3d> shortTour(const Eigen::Vector3d& start,
                                       std::vector<Eigen::Vector3d> places);

std::unique_ptr<ViewSource> makeOctomapFrontier(const BaselineOptions& options,
                                                const Eigen::AlignedBox3d& target,
                                                std::uint64_t seed);

}  // namespace riftmap
