// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/object_memory.h"

#include <algorithm>
#include <set>

namespace riftmap {

void PromiseKept::note(double promised, double came, double least) {
    constexpr double kFade = 0.5;  // the last few views count
    if (promised <= 0 || promised < 0.25 * least) {
        return;
    }
    promised_ = kFade * promised_ + promised;
    came_ = kFade * came_ + std::min(came, most_ * promised);
    share_ = std::clamp((came_ + 0.5 * least) / (promised_ + 0.5 * least), 0.05, most_);
}

std::array<int, 3> LookedInVain::cubeOf(const Eigen::Vector3d& place, double edge) {
    constexpr double kVoxels = 8;  // of a cube, along each axis
    const Eigen::Vector3i at = (place / (kVoxels * edge)).array().floor().cast<int>();
    return {at.x(), at.y(), at.z()};
}

void LookedInVain::note(const std::vector<Eigen::Vector3d>& places, double kept, double edge) {
    constexpr double kBad = 0.5;
    constexpr double kLeast = 0.3;
    if (kept >= kBad) {
        return;
    }
    std::set<std::array<int, 3>> cubes;
    for (const Eigen::Vector3d& place : places) {
        cubes.insert(cubeOf(place, edge));
    }
    for (const auto& cube : cubes) {
        left_.try_emplace(cube, 1.0).first->second *= std::max(kLeast, kept);
    }
}

double LookedInVain::left(const Eigen::Vector3d& place, double edge) const {
    const auto it = left_.find(cubeOf(place, edge));
    return it == left_.end() ? 1.0 : it->second;
}

void ObjectMemory::update(const SurfaceSummary& summary, double minGain, double edge) {
    const double came = summary.newArea();
    const double least = minGain * summary.area();
    const double ofNew = frontierGain + tearGain;
    if (ofNew > 0 && ofNew >= 0.25 * least) {
        // As they were promised, so they are taken to have come.
        frontier.note(frontierGain / frontier.share(), came / ofNew * frontierGain, least);
        tears.note(tearGain / tears.share(), came / ofNew * tearGain, least);
        if (frontierGain >= tearGain) {
            lookedInVain.note(looked, (came + 0.5 * least) / (ofNew + 0.5 * least), edge);
        }
    }
    doubt.note(doubtGain / doubt.share(), std::max(0.0, came - ofNew), least);
}

}  // namespace riftmap
