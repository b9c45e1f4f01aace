// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "riftmap/core/pose.h"

namespace riftmap {

/// Poses of one body over time, in any order of arrival. Not thread-safe while poses are added.
class PoseTrack {
 public:
    /// @param time_ns since the Unix epoch [ns]; of two poses of one time the later added wins
    void add(std::int64_t time_ns, const Pose& world_T_body);

    /// The pose at a time: a recorded one, or between two recorded ones (translation linearly,
    /// rotation by slerp). Nothing before the first and after the last pose, and nothing in a gap
    /// longer than `maxGap_ns`.
    std::optional<Pose> at(std::int64_t time_ns, std::int64_t maxGap_ns) const;

    std::size_t size() const { return poses_.size(); }
    bool empty() const { return poses_.empty(); }

 private:
    std::vector<std::pair<std::int64_t, Pose>> poses_;  ///< ascending in time
};

}  // namespace riftmap
