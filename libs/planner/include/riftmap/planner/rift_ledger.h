// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "riftmap/planner/surface_summary.h"

namespace riftmap {

/// What is to be said of a tear in the surface.
enum class RiftState {
    kOpen,             ///< a view may close it
    kDeferred,         ///< it may, but the run ended before (limits on views, metres, seconds), no
                       ///< way is known to the free places that see it, or it is one of too many
                       ///< small ones to be looked at by itself
    kUnreachable,      ///< no place known to be free lies within the range of it
    kUnobservable,     ///< hidden from every place that can be reached
    kBelowResolution,  ///< smaller than the surface was asked to be known, or too small to be worth
                       ///< a view, or finer than the views of it resolved, or no tear, but seen
                       ///< only from where it cannot be known as well as asked
    kResolved,         ///< was open, is closed
};
inline constexpr std::size_t kRiftStates = 6;
/// "open", "deferred", "unreachable", "unobservable", "below_resolution", "resolved".
const char* nameOf(RiftState state);

/// A try to close a tear.
struct Attempt {
    Eigen::Vector3f direction;  ///< from the tear to the camera, unit
    float distance;             ///< [m]
};

/// The piece of a rift within one cell of the SurfaceSummary: what was tried and what came of it.
struct RiftRecord {
    SurfaceCell cell;  ///< as last seen with a tear in it
    RiftState state = RiftState::kOpen;
    std::string reason;
    std::vector<Attempt> attempts;   ///< those that did not help
    int reconsidered = 0;            ///< times it was opened again
    std::uint32_t verticesThen = 0;  ///< in the cell when it was given up
    bool changed = false;            ///< since RiftLedger::takeChanged()
};

/// A tear before the view that is to close it.
struct TriedTear {
    std::uint64_t key;   ///< of its cell
    float size;          ///< as RiftLedger::tear() has it [m^2]
    std::uint8_t kinds;  ///< OpenKind bits
};

/// The memory of the run: every tear that was ever seen, by cell. A try that closed nothing is
/// remembered; after several different ones the tear is given up, until the surface at it changes.
class RiftLedger {
 public:
    /// `resolution` [m]: tears shorter than about this do not count. `maxAttempts` >= 1.
    RiftLedger(double resolution, int maxAttempts);
    RiftLedger(const RiftLedger&) = delete;  // who was given records points to them
    RiftLedger& operator=(const RiftLedger&) = delete;

    /// Reads the cells that changed.
    void update(const SurfaceSummary& summary);
    /// The tears of these cells as they are, for judge().
    std::vector<TriedTear> tears(const std::vector<std::uint64_t>& keys, double cellSize) const;
    /// A view from `eye` was taken to close these tears, and has been merged and summed up.
    void judge(const SurfaceSummary& summary, const std::vector<TriedTear>& tried,
               const Eigen::Vector3d& eye);
    /// What a view of a tear without a match is worth by what came of such views: the share of
    /// tears tried that they helped to close, over the usual one of a half, of all tries and more
    /// and more of those in the tear's own block; in (0, 1], 1 for other tears. Where a surface is
    /// plain no view helps, and its next tear was not tried yet.
    double tryWorth(const RiftRecord& record) const;
    /// Gives a cell up.
    void giveUp(std::uint64_t key, RiftState state, const std::string& reason);
    /// What was given up in this state may be closed after all: it is open again.
    void reopen(RiftState state);
    /// Ends the run: what is open becomes deferred.
    void deferOpen(const std::string& reason);

    /// Size of the tear in a cell [m^2]: area that closing it may bring at least.
    float tear(const SurfaceCell& cell, double cellSize) const;
    /// By key; none is ever removed, and each stays where it is.
    const std::map<std::uint64_t, RiftRecord>& records() const { return records_; }
    /// The records whose cell, state or reason was written since the last call, ascending in key.
    std::vector<const RiftRecord*> takeChanged();
    /// Those of the cells in one block of the summary, ascending in key; valid until the next
    /// update(). O(1).
    std::span<const RiftRecord* const> inBlock(std::uint64_t block) const;
    /// Of records, by state.
    const std::array<std::size_t, kRiftStates>& counts() const { return counts_; }
    /// Share of the area seen again that a vain try from here repeats: true if some attempt looked
    /// from nearly the same side and distance.
    static bool tried(const RiftRecord& record, const Eigen::Vector3d& eye);

 private:
    void updateCell(const SurfaceCell& cell, double cellSize);
    void setState(RiftRecord& record, RiftState state, const std::string& reason);
    void note(RiftRecord& record);

    double resolution_;
    int maxAttempts_;
    struct Tries {
        int all = 0, helped = 0;
    };
    std::map<std::uint64_t, RiftRecord> records_;
    std::unordered_map<std::uint64_t, std::vector<RiftRecord*>> byBlock_;
    std::vector<RiftRecord*> changed_;
    std::array<std::size_t, kRiftStates> counts_{};
    Tries unmatched_;                                            ///< of tears without a match
    std::unordered_map<std::uint64_t, Tries> unmatchedByBlock_;  ///< the same
};

}  // namespace riftmap
