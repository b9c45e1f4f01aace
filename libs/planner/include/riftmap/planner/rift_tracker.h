// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "riftmap/planner/rift_ledger.h"

namespace riftmap {

/// A connected piece of what is torn: cells of one state that touch each other, by a face, an edge
/// or a corner.
struct CellGroup {
    RiftState state = RiftState::kOpen;
    std::vector<std::uint64_t> cells;  ///< keys, ascending; at least one
};

/// All records that are not resolved, by group; in the order of their first cells. O(n log n).
using RiftRecords = std::map<std::uint64_t, RiftRecord>;
std::vector<CellGroup> connectedCells(const RiftRecords& records);

/// A rift over the whole run: one line of the certificate. Map frame, metres. What is said of size
/// and place is as it was in the last view that had it.
struct TrackedRift {
    std::uint32_t id = 0;  ///< in the order of appearance
    RiftState state = RiftState::kOpen;
    std::string reason;                                ///< that most of its cells have
    std::uint8_t kinds = 0;                            ///< OpenKind bits of all of them
    Eigen::Vector3f centre = Eigen::Vector3f::Zero();  ///< the place in it nearest to its mean
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< mean, unit or zero
    double extent = 0;                                 ///< longest side of the box around its cells
    double rim = 0;                                    ///< length of what is torn, about [m]
    double coarse = 0;  ///< area sampled too sparsely or known too badly, about [m^2]
    std::size_t openVertices = 0, highEdges = 0;
    std::vector<std::uint64_t> cells;         ///< ascending
    std::size_t firstView = 0, lastView = 0;  ///< from 0
    std::set<std::size_t> tries;              ///< views that were to close some of it
    std::set<std::uint32_t> parents;          ///< rifts that it split off
    std::set<std::uint32_t> joined;           ///< rifts that have become part of it
};

/// Follows rifts from view to view as they shrink, split and join. Each rift lives on in the group
/// that holds most of its cells. Where several live on in one group, it keeps the oldest id and the
/// others have joined it. A group in which none lives on, but which holds cells of some, has split
/// off those. So every id that ever was is either a rift's or in one rift's `joined`. A rift
/// without cells is resolved; torn again, it is a new one. Not thread-safe.
class RiftTracker {
 public:
    /// `cellSize` of the summary that the records are of [m].
    explicit RiftTracker(double cellSize) : cellSize_(cellSize) {}

    /// `records` of the ledger after it has taken in this view, which was to close the cells
    /// `aimedAt` (keys). O(n log n) in the records.
    void update(std::size_t view, const RiftRecords& records,
                const std::vector<std::uint64_t>& aimedAt);

    /// By id.
    const std::map<std::uint32_t, TrackedRift>& rifts() const { return rifts_; }
    std::array<std::size_t, kRiftStates> counts() const;
    /// The rift of each cell that is torn, by key.
    const std::map<std::uint64_t, std::uint32_t>& owners() const { return owners_; }

 private:
    void noteTries(std::size_t view, const std::vector<std::uint64_t>& aimedAt);
    std::uint32_t nameOf(const std::set<std::uint32_t>& heirTo,
                         const std::map<std::uint32_t, std::size_t>& shared, std::size_t view);
    void describe(TrackedRift& rift, const CellGroup& group, const RiftRecords& records) const;

    double cellSize_;
    std::uint32_t nextId_ = 0;
    std::map<std::uint32_t, TrackedRift> rifts_;
    std::map<std::uint64_t, std::uint32_t> owners_;
};

}  // namespace riftmap
