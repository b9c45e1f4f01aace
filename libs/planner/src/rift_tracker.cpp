// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/rift_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <limits>
#include <string_view>
#include <utility>

#include "riftmap/core/union_find.h"

namespace riftmap {

namespace {

/// The reason that most of the cells have; of equals the first in the alphabet.
std::string commonReason(const std::vector<const RiftRecord*>& cells) {
    std::map<std::string_view, std::size_t> votes;
    for (const RiftRecord* cell : cells) {
        ++votes[cell->reason];
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

/// The groups of these cells, which ascend in key, in the order of their first keys.
std::vector<RiftTracker::Group> RiftTracker::connected(const std::vector<Cell>& cells) {
    const auto keyOf = [&](std::size_t i) { return cells[i].record->cell.key; };
    const auto stateOf = [&](std::size_t i) { return cells[i].record->state; };
    UnionFind sets(cells.size());
    for (const std::uint64_t offset : SurfaceSummary::neighbourOffsets()) {
        std::size_t j = 0;  // walks ahead of i, since both ascend
        for (std::size_t i = 0; i < cells.size(); ++i) {
            while (j < cells.size() && keyOf(j) < keyOf(i) + offset) {
                ++j;
            }
            if (j < cells.size() && keyOf(j) == keyOf(i) + offset && stateOf(i) == stateOf(j)) {
                sets.unite(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
            }
        }
    }
    std::vector<Group> groups;
    std::vector<std::size_t> groupOf(cells.size());
    for (std::uint32_t i = 0; i < cells.size(); ++i) {
        const std::uint32_t root = sets.root(i);
        if (root == i) {
            groupOf[i] = groups.size();
            groups.push_back({stateOf(i), {}});
        }
        groupOf[i] = groupOf[root];
        groups[groupOf[i]].cells.push_back(cells[i]);
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

/// The rifts whose cells have changed, and those that cells of a new state touch.
std::set<std::uint32_t> RiftTracker::affectedBy(
    const std::vector<const RiftRecord*>& changed) const {
    std::set<std::uint32_t> affected;
    for (const RiftRecord* cell : changed) {
        const std::uint64_t key = cell->cell.key;
        const auto owner = owners_.find(key);
        const bool owned = owner != owners_.end();
        if (owned) {
            affected.insert(owner->second);
        }
        if (cell->state == RiftState::kResolved ||
            (owned && rifts_.at(owner->second).state == cell->state)) {
            continue;
        }
        for (const std::uint64_t offset : SurfaceSummary::neighbourOffsets()) {
            for (const std::uint64_t beside : {key - offset, key + offset}) {
                const auto other = owners_.find(beside);
                if (other != owners_.end() && rifts_.at(other->second).state == cell->state) {
                    affected.insert(other->second);
                }
            }
        }
    }
    return affected;
}

/// What is torn of these rifts and of what has changed, ascending in key.
std::vector<RiftTracker::Cell> RiftTracker::tornOf(
    const std::set<std::uint32_t>& affected, const std::vector<const RiftRecord*>& changed) const {
    std::vector<Cell> torn;
    const auto add = [&](const std::vector<const RiftRecord*>& records, std::uint32_t owner) {
        for (const RiftRecord* record : records) {
            if (record->state != RiftState::kResolved) {
                torn.push_back({record, owner});
            }
        }
    };
    for (const std::uint32_t id : affected) {
        add(rifts_.at(id).cells, id);
    }
    add(changed, kNone);
    std::sort(torn.begin(), torn.end(), [](const Cell& a, const Cell& b) {
        return std::pair(a.record->cell.key, a.owner) < std::pair(b.record->cell.key, b.owner);
    });
    const auto same = [](const Cell& a, const Cell& b) { return a.record == b.record; };
    torn.erase(std::unique(torn.begin(), torn.end(), same), torn.end());  // the first is owned
    return torn;
}

void RiftTracker::setState(TrackedRift& rift, RiftState state) {
    --counts_[static_cast<std::size_t>(rift.state)];
    rift.state = state;
    ++counts_[static_cast<std::size_t>(state)];
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
        ++counts_[static_cast<std::size_t>(fresh.state)];
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

void RiftTracker::describe(TrackedRift& rift, const Group& group) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::AlignedBox3i box;
    rift.cells.clear();
    setState(rift, group.state);
    rift.kinds = 0;
    rift.rim = rift.coarse = 0;
    rift.openVertices = rift.highEdges = 0;
    for (const Cell& torn : group.cells) {
        rift.cells.push_back(torn.record);
        const SurfaceCell& cell = torn.record->cell;
        rift.kinds |= cell.kinds;
        rift.rim += static_cast<double>(cell.rim);
        rift.coarse += static_cast<double>(cell.coarse);
        rift.openVertices += cell.open;
        rift.highEdges += cell.highEdges;
        mean += cell.openPosition.cast<double>();
        normal += cell.openNormal.cast<double>();
        box.extend(SurfaceSummary::indexOf(cell.key));
    }
    rift.reason = commonReason(rift.cells);
    mean /= static_cast<double>(rift.cells.size());
    rift.extent = cellSize_ * (box.sizes().maxCoeff() + 1);
    rift.normal = normal.norm() > 1e-6 ? normal.normalized().cast<float>().eval()
                                       : Eigen::Vector3f::Zero().eval();
    float least = std::numeric_limits<float>::infinity();
    for (const RiftRecord* record : rift.cells) {
        const Eigen::Vector3f& place = record->cell.openPosition;
        const float distance = (place - mean.cast<float>()).squaredNorm();
        if (distance < least) {
            least = distance;
            rift.centre = place;
        }
    }
}

void RiftTracker::update(std::size_t view, const std::vector<const RiftRecord*>& changed,
                         const std::vector<std::uint64_t>& aimedAt) {
    noteTries(view, aimedAt);
    const std::set<std::uint32_t> affected = affectedBy(changed);
    const std::vector<Group> groups = connected(tornOf(affected, changed));
    std::vector<std::map<std::uint32_t, std::size_t>> shared(groups.size());  // cells by rift
    std::map<std::uint32_t, std::map<std::size_t, std::size_t>> lives;        // cells by group
    for (std::size_t g = 0; g < groups.size(); ++g) {
        for (const Cell& cell : groups[g].cells) {
            if (cell.owner != kNone) {
                ++shared[g][cell.owner];
                ++lives[cell.owner][g];
            }
        }
    }
    std::vector<std::set<std::uint32_t>> heirTo(groups.size());
    for (const auto& [id, cellsByGroup] : lives) {
        heirTo[heirOf(cellsByGroup)].insert(id);
    }
    for (const std::uint32_t id : affected) {
        TrackedRift& rift = rifts_.at(id);
        for (const RiftRecord* cell : rift.cells) {
            if (cell->state == RiftState::kResolved) {
                owners_.erase(cell->cell.key);
            }
        }
        if (!lives.contains(id)) {
            setState(rift, RiftState::kResolved);
            rift.reason = commonReason(rift.cells);
            rift.closedAfter = view_;
        }
    }
    std::vector<std::uint32_t> names;
    for (std::size_t g = 0; g < groups.size(); ++g) {
        names.push_back(nameOf(heirTo[g], shared[g], view));
    }
    for (std::size_t g = 0; g < groups.size(); ++g) {
        for (const std::uint32_t id : heirTo[g]) {
            if (id != names[g]) {  // has joined
                --counts_[static_cast<std::size_t>(rifts_.at(id).state)];
                rifts_.erase(id);
            }
        }
        describe(rifts_.at(names[g]), groups[g]);
        for (const Cell& cell : groups[g].cells) {
            if (cell.owner != names[g]) {
                owners_[cell.record->cell.key] = names[g];
            }
        }
    }
    view_ = view;
}

}  // namespace riftmap
