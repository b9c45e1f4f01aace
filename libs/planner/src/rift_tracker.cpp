// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/rift_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <string_view>

#include "riftmap/core/union_find.h"

namespace riftmap {

namespace {

/// The reason that most of the cells have; of equals the first in the alphabet.
std::string commonReason(const std::vector<std::uint64_t>& cells, const RiftRecords& records) {
    std::map<std::string_view, std::size_t> votes;
    for (const std::uint64_t key : cells) {
        ++votes[records.at(key).reason];
    }
    const auto most =
        std::max_element(votes.begin(), votes.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    return most == votes.end() ? std::string() : std::string(most->first);
}

/// The group that holds most of a rift's cells; of equals the first.
std::size_t heirOf(const std::map<std::size_t, std::size_t>& cellsByGroup) {
    return std::max_element(cellsByGroup.begin(), cellsByGroup.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
}

}  // namespace

std::vector<CellGroup> connectedCells(const RiftRecords& records) {
    std::vector<std::uint64_t> keys;
    std::vector<RiftState> states;
    for (const auto& [key, record] : records) {
        if (record.state != RiftState::kResolved) {
            keys.push_back(key);
            states.push_back(record.state);
        }
    }
    UnionFind sets(keys.size());
    for (const std::uint64_t offset : SurfaceSummary::neighbourOffsets()) {
        std::size_t j = 0;  // walks ahead of i, since both ascend
        for (std::size_t i = 0; i < keys.size(); ++i) {
            while (j < keys.size() && keys[j] < keys[i] + offset) {
                ++j;
            }
            if (j < keys.size() && keys[j] == keys[i] + offset && states[i] == states[j]) {
                sets.unite(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
            }
        }
    }
    std::vector<CellGroup> groups;
    std::vector<std::size_t> groupOf(keys.size());
    for (std::uint32_t i = 0; i < keys.size(); ++i) {
        const std::uint32_t root = sets.root(i);
        if (root == i) {
            groupOf[i] = groups.size();
            groups.push_back({states[i], {}});
        }
        groupOf[i] = groupOf[root];
        groups[groupOf[i]].cells.push_back(keys[i]);
    }
    return groups;
}

void RiftTracker::noteTries(std::size_t view, const std::vector<std::uint64_t>& aimedAt) {
    for (const std::uint64_t key : aimedAt) {
        if (const auto owner = owners_.find(key); owner != owners_.end()) {
            rifts_.at(owner->second).tries.insert(view);
        }
    }
}

/// The rift that a group is from now on: the oldest of those that live on in it, which the others
/// join; else a new one.
std::uint32_t RiftTracker::nameOf(const std::set<std::uint32_t>& heirTo,
                                  const std::map<std::uint32_t, std::size_t>& shared,
                                  std::size_t view) {
    if (heirTo.empty()) {
        TrackedRift& fresh = rifts_[nextId_];
        fresh.id = nextId_++;
        fresh.firstView = view;
        for (const auto& [id, cells] : shared) {
            fresh.parents.insert(id);
            fresh.tries.insert(rifts_.at(id).tries.begin(), rifts_.at(id).tries.end());
        }
        return fresh.id;
    }
    const std::uint32_t oldest = *heirTo.begin();
    TrackedRift& kept = rifts_.at(oldest);
    for (auto id = std::next(heirTo.begin()); id != heirTo.end(); ++id) {
        const auto other = rifts_.find(*id);
        kept.joined.insert(*id);
        kept.joined.insert(other->second.joined.begin(), other->second.joined.end());
        kept.tries.insert(other->second.tries.begin(), other->second.tries.end());
    }
    return oldest;
}

void RiftTracker::describe(TrackedRift& rift, const CellGroup& group,
                           const RiftRecords& records) const {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::AlignedBox3i box;
    rift.cells = group.cells;
    rift.state = group.state;
    rift.reason = commonReason(group.cells, records);
    rift.kinds = 0;
    rift.rim = rift.coarse = 0;
    rift.openVertices = rift.highEdges = 0;
    for (const std::uint64_t key : group.cells) {
        const SurfaceCell& cell = records.at(key).cell;
        rift.kinds |= cell.kinds;
        rift.rim += static_cast<double>(cell.rim);
        rift.coarse += static_cast<double>(cell.coarse);
        rift.openVertices += cell.open;
        rift.highEdges += cell.highEdges;
        mean += cell.openPosition.cast<double>();
        normal += cell.openNormal.cast<double>();
        box.extend(SurfaceSummary::indexOf(key));
    }
    mean /= static_cast<double>(group.cells.size());
    rift.extent = cellSize_ * (box.sizes().maxCoeff() + 1);
    rift.normal = normal.norm() > 1e-6 ? normal.normalized().cast<float>().eval()
                                       : Eigen::Vector3f::Zero().eval();
    float least = std::numeric_limits<float>::infinity();
    for (const std::uint64_t key : group.cells) {
        const Eigen::Vector3f& place = records.at(key).cell.openPosition;
        const float distance = (place - mean.cast<float>()).squaredNorm();
        if (distance < least) {
            least = distance;
            rift.centre = place;
        }
    }
}

void RiftTracker::update(std::size_t view, const RiftRecords& records,
                         const std::vector<std::uint64_t>& aimedAt) {
    noteTries(view, aimedAt);
    const std::vector<CellGroup> groups = connectedCells(records);
    std::vector<std::map<std::uint32_t, std::size_t>> shared(groups.size());  // cells by rift
    std::map<std::uint32_t, std::map<std::size_t, std::size_t>> lives;        // cells by group
    for (std::size_t g = 0; g < groups.size(); ++g) {
        for (const std::uint64_t key : groups[g].cells) {
            if (const auto owner = owners_.find(key); owner != owners_.end()) {
                ++shared[g][owner->second];
                ++lives[owner->second][g];
            }
        }
    }
    std::vector<std::set<std::uint32_t>> heirTo(groups.size());
    for (const auto& [id, cellsByGroup] : lives) {
        heirTo[heirOf(cellsByGroup)].insert(id);
    }
    for (auto& [id, rift] : rifts_) {
        if (rift.state != RiftState::kResolved && !lives.contains(id)) {
            rift.state = RiftState::kResolved;
            rift.reason = commonReason(rift.cells, records);
        }
    }
    std::vector<std::uint32_t> names;
    for (std::size_t g = 0; g < groups.size(); ++g) {
        names.push_back(nameOf(heirTo[g], shared[g], view));
    }
    owners_.clear();
    for (std::size_t g = 0; g < groups.size(); ++g) {
        for (auto id = heirTo[g].begin(); id != heirTo[g].end(); ++id) {
            if (*id != names[g]) {  // has joined
                rifts_.erase(*id);
            }
        }
        TrackedRift& rift = rifts_.at(names[g]);
        describe(rift, groups[g], records);
        rift.lastView = view;
        for (const std::uint64_t key : groups[g].cells) {
            owners_[key] = names[g];
        }
    }
}

std::array<std::size_t, kRiftStates> RiftTracker::counts() const {
    std::array<std::size_t, kRiftStates> n{};
    for (const auto& [id, rift] : rifts_) {
        ++n[static_cast<std::size_t>(rift.state)];
    }
    return n;
}

}  // namespace riftmap
