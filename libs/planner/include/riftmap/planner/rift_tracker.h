// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "riftmap/planner/rift_ledger.h"

namespace riftmap {

/// A rift over the whole run: one line of the certificate. Map frame, metres. What is said of size
/// and place is as it was in the last view that had it; its cells are the ledger's records, which
/// go on (once it is resolved they may be torn again and another rift's).
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
    std::vector<const RiftRecord*> cells;  ///< ascending in key
    std::size_t firstView = 0;             ///< from 0
    std::size_t closedAfter = 0;           ///< once it is resolved: the last view that had it
    std::set<std::size_t> tries;           ///< views that were to close some of it
    std::set<std::uint32_t> parents;       ///< rifts that it split off
    std::set<std::uint32_t> joined;        ///< rifts that have become part of it
};

/// Follows rifts from view to view as they shrink, split and join. A group is a connected piece of
/// what is torn: cells of one state that touch each other, by a face, an edge or a corner; groups
/// are named in the order of their first keys. Each rift lives on in the group that holds most of
/// its cells. Where several live on in one group, it keeps the oldest id and the others have joined
/// it. A group in which none lives on, but which holds cells of some, has split off those. So every
/// id that ever was is either a rift's or in one rift's `joined`. A rift without cells is resolved;
/// torn again, it is a new one. Points to the ledger's records, which must outlive it. Not
/// thread-safe.
class RiftTracker {
 public:
    /// `cellSize` of the summary that the records are of [m].
    explicit RiftTracker(double cellSize) : cellSize_(cellSize) {}

    /// `changed`: what the ledger has written since the last update (RiftLedger::takeChanged()),
    /// in any order, after it has taken in this view, which was to close the cells `aimedAt`
    /// (keys). More than that does no harm. Only the rifts of cells that changed, and those that
    /// such cells come to touch, are looked at, each as a whole: O(n log n) in their cells.
    void update(std::size_t view, const std::vector<const RiftRecord*>& changed,
                const std::vector<std::uint64_t>& aimedAt);

    /// By id.
    const std::map<std::uint32_t, TrackedRift>& rifts() const { return rifts_; }
    /// Of rifts, by state.
    const std::array<std::size_t, kRiftStates>& counts() const { return counts_; }
    /// The last view that had this rift.
    std::size_t lastView(const TrackedRift& rift) const {
        return rift.state == RiftState::kResolved ? rift.closedAfter : view_;
    }
    /// The rift of each cell that is torn, by the cell's key.
    const std::unordered_map<std::uint64_t, std::uint32_t>& owners() const { return owners_; }

 private:
    struct Cell {
        const RiftRecord* record;
        std::uint32_t owner;  ///< rift that it was of, or kNone
    };
    struct Group {
        RiftState state = RiftState::kOpen;
        std::vector<Cell> cells;  ///< ascending in key; at least one
    };
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    static std::vector<Group> connected(const std::vector<Cell>& cells);

    void noteTries(std::size_t view, const std::vector<std::uint64_t>& aimedAt);
    std::set<std::uint32_t> affectedBy(const std::vector<const RiftRecord*>& changed) const;
    std::vector<Cell> tornOf(const std::set<std::uint32_t>& affected,
                             const std::vector<const RiftRecord*>& changed) const;
    std::uint32_t nameOf(const std::set<std::uint32_t>& heirTo,
                         const std::map<std::uint32_t, std::size_t>& shared, std::size_t view);
    void setState(TrackedRift& rift, RiftState state);
    void describe(TrackedRift& rift, const Group& group);

    double cellSize_;
    std::uint32_t nextId_ = 0;
    std::size_t view_ = 0;  ///< of the last update
    std::map<std::uint32_t, TrackedRift> rifts_;
    std::array<std::size_t, kRiftStates> counts_{};
    std::unordered_map<std::uint64_t, std::uint32_t> owners_;
};

}  // namespace riftmap
