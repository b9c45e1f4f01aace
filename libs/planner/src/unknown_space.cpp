// SPDX-License-Identifier: BSD-3-Clause
// What of the free space is unknown, and where it begins.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "riftmap/planner/free_space.h"

namespace riftmap {

FreeSpace::UnknownRun FreeSpace::firstUnknown(const Eigen::Vector3d& origin,
                                              const Eigen::Vector3d& direction,
                                              double length) const {
    const double step = 0.9 * voxel_;
    const Eigen::Vector3d start = (origin - origin_) / voxel_;
    const Eigen::Vector3d along = direction / voxel_;
    UnknownRun run;
    for (double s = step; s < length; s += step) {
        const Eigen::Vector3i v = wholesBelow(start + s * along);
        if (!inside(v)) {
            break;
        }
        const std::uint8_t voxel = voxels_[index(v)];
        const bool known = (voxel & (kFreeBit | kKnownBit | kSurfaceBit)) != 0;
        if (run.begin < 0 && !known && (voxel >> kTryShift) < kTries) {
            run.begin = s;
        } else if (run.begin < 0 && ((voxel & kSurfaceBit) != 0 || !known)) {
            return {};
        } else if (run.begin >= 0 && known) {
            break;
        }
        run.end = s;
    }
    return run;
}

std::size_t FreeSpace::regionOf(const Eigen::Vector3i& v) const {
    const Eigen::Vector3i r = v / kRegion;
    const Eigen::Vector3i count = (size_ + Eigen::Vector3i::Constant(kRegion - 1)) / kRegion;
    return (static_cast<std::size_t>(r.z()) * static_cast<std::size_t>(count.y()) +
            static_cast<std::size_t>(r.y())) *
               static_cast<std::size_t>(count.x()) +
           static_cast<std::size_t>(r.x());
}

void FreeSpace::noteLook(const Eigen::Vector3d& place, bool matched) {
    const Eigen::Vector3i v = voxelOf(place);
    if (!inside(v)) {
        return;
    }
    if (looks_.empty()) {
        looks_.resize(regionOf(size_ - Eigen::Vector3i::Ones()) + 1);
    }
    Looks& looks = looks_[regionOf(v)];
    ++looks.all;
    looks.matched += matched ? 1 : 0;
}

double FreeSpace::lookWorth(const Eigen::Vector3d& place) const {
    constexpr double kUsual = 0.6;  // of looks match: near edges and at flat angles none do
    constexpr double kBefore = 8;   // looks (one view has several here) taken to have matched
    const Eigen::Vector3i v = voxelOf(place);
    if (looks_.empty() || !inside(v)) {
        return 1;
    }
    const Looks& looks = looks_[regionOf(v)];
    return std::min(1.0, (looks.matched + kBefore) / (looks.all + kBefore) / kUsual);
}

std::vector<Eigen::Vector3d> FreeSpace::toBeLookedAt(const Eigen::Vector3d& from,
                                                     const Eigen::Vector3d& to,
                                                     double radius) const {
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius);
    const Eigen::Vector3i first = voxelOf(from.cwiseMin(to) - reach).cwiseMax(0);
    const Eigen::Vector3i last =
        voxelOf(from.cwiseMax(to) + reach).cwiseMin(size_ - Eigen::Vector3i::Ones());
    const Eigen::Vector3d way = to - from;
    const double length2 = std::max(way.squaredNorm(), 1e-12);
    std::vector<Eigen::Vector3d> unknown;
    for (int z = first.z(); z <= last.z(); ++z) {
        for (int y = first.y(); y <= last.y(); ++y) {
            for (int x = first.x(); x <= last.x(); ++x) {
                const Eigen::Vector3d p = centre({x, y, z});
                const double s = std::clamp(way.dot(p - from) / length2, 0.0, 1.0);
                const std::uint8_t voxel = voxels_[index({x, y, z})];
                if (passable(voxel) || (p - from - s * way).norm() >= radius) {
                    continue;
                }
                if ((voxel & kSurfaceBit) != 0 || (voxel >> kTryShift) >= kTries) {
                    return {};
                }
                unknown.push_back(p);
            }
        }
    }
    return unknown;
}

std::vector<FreeSpace::Frontier> FreeSpace::frontier(const Eigen::AlignedBox3d& within) const {
    const auto looks = [&](const Eigen::Vector3i& v) {
        const std::uint8_t voxel = voxels_[index(v)];
        return (voxel & kSurfaceBit) == 0 && (voxel & kSeenBit) != 0;
    };
    const Eigen::Vector3i first = voxelOf(within.min()).cwiseMax(0);
    const Eigen::Vector3i last = voxelOf(within.max()).cwiseMin(size_ - Eigen::Vector3i::Ones());
    std::vector<Frontier> found;
    for (int z = first.z(); z <= last.z(); ++z) {
        for (int y = first.y(); y <= last.y(); ++y) {
            for (int x = first.x(); x <= last.x(); ++x) {
                const Eigen::Vector3i v(x, y, z);
                const std::uint8_t voxel = voxels_[index(v)];
                if ((voxel & (kFreeBit | kKnownBit | kSurfaceBit)) != 0 ||
                    (voxel >> kTryShift) >= kTries || !within.contains(centre(v))) {
                    continue;
                }
                Eigen::Vector3i out = Eigen::Vector3i::Zero();
                int faces = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    for (const int side : {-1, 1}) {
                        Eigen::Vector3i w = v;
                        w[axis] += side;
                        if (inside(w) && looks(w)) {
                            out[axis] += side;
                            ++faces;
                        }
                    }
                }
                if (faces > 0) {
                    const auto face = static_cast<float>(voxel_ * voxel_);
                    found.push_back({centre(v).cast<float>(), face * out.cast<float>()});
                }
            }
        }
    }
    return found;
}

}  // namespace riftmap
