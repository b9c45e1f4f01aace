// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/pose_track.h"

#include <algorithm>
#include <iterator>

namespace riftmap {
namespace {

bool earlier(const std::pair<std::int64_t, Pose>& pose, std::int64_t time_ns) {
    return pose.first < time_ns;
}

}  // namespace

void PoseTrack::add(std::int64_t time_ns, const Pose& world_T_body) {
    const auto at = std::lower_bound(poses_.begin(), poses_.end(), time_ns, earlier);
    if (at != poses_.end() && at->first == time_ns) {
        at->second = world_T_body;
    } else {
        poses_.emplace(at, time_ns, world_T_body);
    }
}

std::optional<Pose> PoseTrack::at(std::int64_t time_ns, std::int64_t maxGap_ns) const {
    const auto after = std::lower_bound(poses_.begin(), poses_.end(), time_ns, earlier);
    if (after == poses_.end()) {
        return std::nullopt;
    }
    if (after->first == time_ns) {
        return after->second;
    }
    if (after == poses_.begin()) {
        return std::nullopt;
    }
    const auto before = std::prev(after);
    const auto gap = after->first - before->first;
    if (gap > maxGap_ns) {
        return std::nullopt;
    }
    const double s = static_cast<double>(time_ns - before->first) / static_cast<double>(gap);
    return interpolate(before->second, after->second, s);
}

}  // namespace riftmap
