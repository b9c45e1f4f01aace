// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/free_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace riftmap {

namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
const std::array<Eigen::Vector3i, 6> kFaces = {Eigen::Vector3i(1, 0, 0), Eigen::Vector3i(-1, 0, 0),
                                               Eigen::Vector3i(0, 1, 0), Eigen::Vector3i(0, -1, 0),
                                               Eigen::Vector3i(0, 0, 1), Eigen::Vector3i(0, 0, -1)};

/// Offsets of all voxels nearer than the radius.
std::vector<Eigen::Vector3i> ball(double radiusInVoxels) {
    const int r = static_cast<int>(std::ceil(radiusInVoxels));
    std::vector<Eigen::Vector3i> offsets;
    for (int z = -r; z <= r; ++z) {
        for (int y = -r; y <= r; ++y) {
            for (int x = -r; x <= r; ++x) {
                const Eigen::Vector3i o(x, y, z);
                if (o.cast<double>().norm() < radiusInVoxels) {
                    offsets.push_back(o);
                }
            }
        }
    }
    return offsets;
}

}  // namespace

FreeSpace::FreeSpace(const Eigen::AlignedBox3d& box, double voxelSize)
    : box_(box), voxel_(voxelSize), origin_(box.min()) {
    if (box.isEmpty() || !(voxelSize > 0)) {
        throw std::invalid_argument("free space: empty box or no voxel size");
    }
    const Eigen::Vector3d count = (box.sizes() / voxelSize).array().ceil().max(1.0);
    if (count.prod() > 134217728.0) {
        throw std::invalid_argument("free space: " + std::to_string(count.prod()) +
                                    " voxels are too many; use a larger voxel or a smaller box");
    }
    size_ = count.cast<int>();
    voxels_.assign(static_cast<std::size_t>(count.prod()), 0);
    pieces_.assign(voxels_.size(), 0);
}

Eigen::Vector3i FreeSpace::coordinates(std::size_t index) const {
    const auto nx = static_cast<std::size_t>(size_.x());
    const auto ny = static_cast<std::size_t>(size_.y());
    return {static_cast<int>(index % nx), static_cast<int>(index / nx % ny),
            static_cast<int>(index / nx / ny)};
}

Eigen::Vector3d FreeSpace::snap(const Eigen::Vector3d& point) const {
    return centre(voxelOf(point));
}

void FreeSpace::declareFreeOutside(const Eigen::AlignedBox3d& surfaces) {
    for (std::size_t i = 0; i < voxels_.size(); ++i) {
        if (surfaces.exteriorDistance(centre(coordinates(i))) > 0.5 * voxel_) {
            voxels_[i] |= kFreeBit | kKnownBit | kSeenBit | kProvenBit | kMiddleBit;
        }
    }
}

void FreeSpace::declareFree(const Eigen::Vector3d& middle, double radius) {
    const Eigen::Vector3i v = voxelOf(middle);
    for (const Eigen::Vector3i& o : ball(radius / voxel_ + 1.0)) {
        const Eigen::Vector3i w = v + o;
        if (inside(w) && (centre(w) - middle).norm() < radius) {
            voxels_[index(w)] |= kFreeBit;
        }
    }
}

void FreeSpace::setSurface(const std::vector<Eigen::Vector3d>& points) {
    for (std::size_t i = 0; i < voxels_.size(); ++i) {
        pieces_[i] = 0;
        voxels_[i] = static_cast<std::uint8_t>(voxels_[i] & ~kSurfaceBit);
    }
    for (const Eigen::Vector3d& point : points) {
        addSurface(point);
    }
}

void FreeSpace::addSurface(const Eigen::Vector3d& point) {
    const Eigen::Vector3i v = voxelOf(point);
    if (inside(v)) {
        ++pieces_[index(v)];
        voxels_[index(v)] |= kSurfaceBit;
    }
}

void FreeSpace::removeSurface(const Eigen::Vector3d& point) {
    const Eigen::Vector3i v = voxelOf(point);
    if (inside(v) && pieces_[index(v)] > 0 && --pieces_[index(v)] == 0) {
        voxels_[index(v)] = static_cast<std::uint8_t>(voxels_[index(v)] & ~kSurfaceBit);
    }
}

FreeSpace::State FreeSpace::at(const Eigen::Vector3d& point) const {
    const Eigen::Vector3i v = voxelOf(point);
    if (!inside(v)) {
        return State::kUnknown;
    }
    const std::uint8_t voxel = voxels_[index(v)];
    if ((voxel & kSurfaceBit) != 0) {
        return State::kSurface;
    }
    return (voxel & (kFreeBit | kKnownBit)) != 0 ? State::kFree : State::kUnknown;
}

void FreeSpace::noteTry(const Eigen::Vector3d& point) {
    const Eigen::Vector3i v = voxelOf(point);
    const std::uint8_t voxel = inside(v) ? voxels_[index(v)] : kFreeBit;
    if ((voxel & (kFreeBit | kSurfaceBit)) == 0 && (voxel >> kTryShift) < kTries) {
        voxels_[index(v)] = static_cast<std::uint8_t>(voxels_[index(v)] + (1 << kTryShift));
    }
}

bool FreeSpace::blocks(std::size_t voxel) const {
    if (passable_[voxel] != 0) {
        return false;
    }
    const Eigen::Vector3i v = coordinates(voxel);
    return std::any_of(kFaces.begin(), kFaces.end(), [&](const Eigen::Vector3i& f) {
        return inside(v + f) && passable_[index(v + f)] != 0;
    });
}

void FreeSpace::updateClear(double clearance, const Eigen::AlignedBox3d& limits) {
    if (clearance_ != clearance || limits_.min() != limits.min() || limits_.max() != limits.max()) {
        clearance_ = clearance;
        limits_ = limits;
        passable_.assign(voxels_.size(), 0);
        blocking_.assign(voxels_.size(), 0);
        blockers_.assign(voxels_.size(), 0);
        allowed_.resize(voxels_.size());
        fits_.clear();
        for (std::size_t i = 0; i < voxels_.size(); ++i) {
            allowed_[i] = limits.contains(centre(coordinates(i))) ? 1 : 0;
        }
    }
    std::vector<std::size_t> changed;
    for (std::size_t i = 0; i < voxels_.size(); ++i) {
        if (passable(voxels_[i]) != (passable_[i] != 0)) {
            passable_[i] = passable(voxels_[i]) ? 1 : 0;
            changed.push_back(i);
        }
    }
    // The surface may lie anywhere in a voxel that is not free, and the way between two centres
    // dips below the clearance of both: one voxel more covers the two.
    const std::vector<Eigen::Vector3i> offsets = ball(clearance / voxel_ + 1.0);
    const auto recount = [&](const Eigen::Vector3i& v) {
        const std::size_t i = index(v);
        const bool now = blocks(i);
        if (now == (blocking_[i] != 0)) {
            return;
        }
        blocking_[i] = now ? 1 : 0;
        for (const Eigen::Vector3i& o : offsets) {
            if (inside(v + o)) {
                now ? ++blockers_[index(v + o)] : --blockers_[index(v + o)];
            }
        }
    };
    for (const std::size_t i : changed) {
        const Eigen::Vector3i v = coordinates(i);
        if (!fits_.empty()) {
            for (const Eigen::Vector3i& o : offsets) {
                if (inside(v + o)) {
                    fits_[index(v + o)] = 0;
                }
            }
        }
        recount(v);
        for (const Eigen::Vector3i& f : kFaces) {
            if (inside(v + f)) {
                recount(v + f);
            }
        }
    }
    clear_.resize(voxels_.size());
    clearCount_ = 0;
    for (std::size_t i = 0; i < voxels_.size(); ++i) {
        clear_[i] =
            static_cast<std::uint8_t>(passable_[i] & allowed_[i] & (blockers_[i] == 0 ? 1 : 0));
        clearCount_ += clear_[i];
    }
}

void FreeSpace::forget(const Eigen::AlignedBox3d& changed) {
    if (fits_.empty()) {
        return;
    }
    // What `fits` looks at: the clearance and the dip between voxels, and what touches that.
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(clearance_ + 3 * voxel_);
    const Eigen::Vector3i first = voxelOf(changed.min() - reach).cwiseMax(0);
    const Eigen::Vector3i last =
        voxelOf(changed.max() + reach).cwiseMin(size_ - Eigen::Vector3i::Ones());
    for (int z = first.z(); z <= last.z(); ++z) {
        for (int y = first.y(); y <= last.y(); ++y) {
            for (int x = first.x(); x <= last.x(); ++x) {
                fits_[index({x, y, z})] = 0;
            }
        }
    }
}

bool FreeSpace::fitsAt(std::size_t voxel, const Fits& fits) {
    if (passable_[voxel] == 0 || allowed_[voxel] == 0) {
        return false;
    }
    if (fits_[voxel] == 0) {
        fits_[voxel] = fits(centre(coordinates(voxel))) ? 2 : 1;
    }
    return fits_[voxel] == 2;
}

void FreeSpace::searchFrom(const Eigen::Vector3i& start, const Fits& fits) {
    distance_.assign(voxels_.size(), kFar);
    step_.assign(voxels_.size(), kNoStep);
    struct Step {
        Eigen::Vector3i offset;
        std::ptrdiff_t jump = 0;  ///< in the array
        float length = 0;
        /// What may follow it on a shortest way: steps to voxels that do not touch the one it comes
        /// from. That one reaches the others sooner by itself: whether a voxel may be entered does
        /// not depend on where from.
        std::vector<std::uint8_t> next;
    };
    std::array<Step, kCubeOfVoxels> steps;
    for (std::uint8_t i = 0; i < kCubeOfVoxels; ++i) {
        const Eigen::Vector3i o = aroundVoxel(i);
        Step& s = steps.at(i);
        s.offset = o;
        s.jump = (static_cast<std::ptrdiff_t>(o.z()) * size_.y() + o.y()) * size_.x() + o.x();
        s.length = static_cast<float>(o.cast<double>().norm() * voxel_);
        for (std::uint8_t next = 0; next < kCubeOfVoxels; ++next) {
            const Eigen::Vector3i both = o + aroundVoxel(next);
            if (next != kNoStep && (i == kNoStep || both.cwiseAbs().maxCoeff() > 1)) {
                s.next.push_back(next);
            }
        }
    }
    // A step is a voxel long at least. Buckets are a little narrower than that, so that no step
    // ends in the bucket it begins in, and the order within one is free. (The hundredth that is
    // spared is more than rounding makes of the length of any way.)
    std::vector<std::vector<std::uint32_t>> buckets(1);
    const auto first = static_cast<std::uint32_t>(index(start));
    distance_[first] = 0;
    buckets[0].push_back(first);
    const auto bucketOf = [width = 0.99F * static_cast<float>(voxel_)](float distance) {
        return static_cast<std::size_t>(distance / width);
    };
    const Eigen::Vector3i last = size_ - Eigen::Vector3i::Ones();
    for (std::size_t b = 0; b < buckets.size(); ++b) {
        const std::vector<std::uint32_t> now = std::move(buckets[b]);
        for (const std::uint32_t i : now) {
            const float d = distance_[i];
            if (bucketOf(d) != b) {
                continue;  // a shorter way was found since
            }
            const Eigen::Vector3i v = coordinates(i);
            const bool border = (v.array() == 0).any() || (v.array() == last.array()).any();
            for (const std::uint8_t next : steps[step_[i]].next) {
                const Step& s = steps[next];
                if (border && !inside(v + s.offset)) {
                    continue;
                }
                const auto j = static_cast<std::uint32_t>(static_cast<std::ptrdiff_t>(i) + s.jump);
                const float before = distance_[j];
                if (d + s.length < before && (clear_[j] != 0 || (fits && fitsAt(j, fits)))) {
                    distance_[j] = d + s.length;
                    step_[j] = next;
                    const std::size_t to = bucketOf(distance_[j]);
                    if (before < kFar && bucketOf(before) == to) {
                        continue;  // is there
                    }
                    if (buckets.size() <= to) {
                        buckets.resize(to + 1);
                    }
                    buckets[to].push_back(j);
                }
            }
        }
    }
}

bool FreeSpace::knownAround(const Eigen::Vector3d& point, double radius, bool corners) const {
    const Eigen::Vector3i first = voxelOf(point - Eigen::Vector3d::Constant(radius));
    const Eigen::Vector3i last = voxelOf(point + Eigen::Vector3d::Constant(radius));
    if (!inside(first) || !inside(last)) {
        return false;
    }
    const auto touchesSurface = [&](const Eigen::Vector3i& v) {
        for (int i = 0; i < kCubeOfVoxels; ++i) {
            const Eigen::Vector3i o = aroundVoxel(i);
            if ((corners || o.squaredNorm() == 1) && inside(v + o) &&
                (voxels_[index(v + o)] & kSurfaceBit) != 0) {
                return true;
            }
        }
        return false;
    };
    for (int z = first.z(); z <= last.z(); ++z) {
        for (int y = first.y(); y <= last.y(); ++y) {
            for (int x = first.x(); x <= last.x(); ++x) {
                const Eigen::Vector3i v(x, y, z);
                const Eigen::Vector3d low = origin_ + v.cast<double>() * voxel_;
                const Eigen::AlignedBox3d box(low, low + Eigen::Vector3d::Constant(voxel_));
                const std::uint8_t voxel = voxels_[index(v)];
                if (box.squaredExteriorDistance(point) >= radius * radius ||
                    (voxel & (kFreeBit | kSurfaceBit)) != 0) {
                    continue;
                }
                if ((voxel & (corners ? kMiddleBit : kKnownBit)) == 0 || !touchesSurface(v)) {
                    return false;
                }
            }
        }
    }
    return true;
}

std::optional<Eigen::Vector3d> FreeSpace::nearestClear(const Eigen::Vector3d& point, int reach,
                                                       bool reached) const {
    const Eigen::Vector3i v = voxelOf(point);
    std::optional<Eigen::Vector3d> nearest;
    for (int z = -reach; z <= reach; ++z) {
        for (int y = -reach; y <= reach; ++y) {
            for (int x = -reach; x <= reach; ++x) {
                const Eigen::Vector3i w = v + Eigen::Vector3i(x, y, z);
                if (!inside(w) || clear_[index(w)] == 0 ||
                    (reached && !std::isfinite(distance_[index(w)]))) {
                    continue;
                }
                const Eigen::Vector3d c = centre(w);
                if (!nearest || (c - point).squaredNorm() < (*nearest - point).squaredNorm()) {
                    nearest = c;
                }
            }
        }
    }
    return nearest;
}

std::size_t FreeSpace::updateReach(const Eigen::Vector3d& start, const Fits& fits) {
    start_ = start;
    const Eigen::Vector3i v = voxelOf(start);
    if (!inside(v)) {
        throw std::invalid_argument("free space: the camera is outside of the workspace");
    }
    if (fits) {
        fits_.resize(voxels_.size(), 0);
    }
    searchFrom(v, fits);  // the camera is there, whatever is known of that voxel
    std::size_t reached = 0;
    for (std::size_t i = 0; i < voxels_.size(); ++i) {
        reached += clear_[i] != 0 && std::isfinite(distance_[i]) ? 1 : 0;
    }
    return reached;
}

double FreeSpace::distanceTo(const Eigen::Vector3d& point) const {
    const Eigen::Vector3i v = voxelOf(point);
    return inside(v) ? static_cast<double>(distance_[index(v)])
                     : std::numeric_limits<double>::infinity();
}

bool FreeSpace::segmentClear(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    const double length = (b - a).norm();
    const int n = std::max(1, static_cast<int>(std::ceil(length / (0.4 * voxel_))));
    for (int i = 0; i <= n; ++i) {
        const Eigen::Vector3i v = voxelOf(a + (b - a) * (static_cast<double>(i) / n));
        if (!inside(v) || clear_[index(v)] == 0) {
            return false;
        }
    }
    return true;
}

std::vector<Eigen::Vector3d> FreeSpace::pathTo(const Eigen::Vector3d& goal) const {
    if (!std::isfinite(distanceTo(goal))) {
        return {};
    }
    std::vector<Eigen::Vector3d> corners;
    Eigen::Vector3i v = voxelOf(goal);
    for (std::uint8_t step = step_[index(v)]; step != kNoStep; step = step_[index(v)]) {
        corners.push_back(centre(v));
        v -= aroundVoxel(step);
    }
    corners.push_back(start_);
    std::reverse(corners.begin(), corners.end());
    std::vector<Eigen::Vector3d> path = {corners.front()};
    for (std::size_t at = 0; at + 1 < corners.size();) {
        std::size_t next = at + 1;
        for (std::size_t far = corners.size() - 1; far > next; --far) {
            if (segmentClear(corners[at], corners[far])) {
                next = far;
                break;
            }
        }
        path.push_back(corners[next]);
        at = next;
    }
    return path;
}

std::vector<Eigen::Vector3d> FreeSpace::reachable(int stride) const {
    std::vector<Eigen::Vector3d> places;
    for (int z = stride / 2; z < size_.z(); z += stride) {
        for (int y = stride / 2; y < size_.y(); y += stride) {
            for (int x = stride / 2; x < size_.x(); x += stride) {
                if (std::isfinite(distance_[index({x, y, z})])) {
                    places.push_back(centre({x, y, z}));
                }
            }
        }
    }
    return places;
}

}  // namespace riftmap
