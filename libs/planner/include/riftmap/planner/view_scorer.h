// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "riftmap/core/pose.h"
#include "riftmap/planner/free_space.h"
#include "riftmap/planner/rift_ledger.h"
#include "riftmap/planner/sensor_model.h"
#include "riftmap/planner/surface_summary.h"
#include "riftmap/planner/view_tour.h"

namespace riftmap {

/// What a view from some pose would bring.
struct ViewScore {
    double gain = 0;         ///< surface that it may add or make better, about [m^2]
    double openGain = 0;     ///< part of it: tears closed and surface known better
    double coarseGain = 0;   ///< part of that: surface known better
    double unknownGain = 0;  ///< part of it: unknown space looked into
    /// Of the field of view that is nearer than the near limit; 0 with exact depth, which nothing
    /// nearer disturbs.
    double nearShare = 0;
    std::vector<std::uint64_t> cells;  ///< open cells that it sees well, ascending
    /// Those that it sees badly, in no order, if they promise more than half of `openGain`: the
    /// view lives on them, and is a try of them.
    std::vector<std::uint64_t> badlySeen;
};

/// Predicts views: the cells of the summary are drawn into a small depth image, which hides what
/// lies behind them; then open cells and unknown space are counted. draw(), score() and estimate()
/// are thread-safe.
class ViewScorer {
 public:
    struct Weights {
        double unknown = 1.0;  ///< of unknown area against that at tears
        /// Good depths up to which new surface counts in full; 0: as far as it comes to lie within
        /// the resolution of where it is.
        double newSurfaceDepth = 1.5;
        double coarse = 0.35;  ///< of surface known better against surface known at all
        double hidden = 3.0;   ///< of the area of gaps: what they hide goes on behind them
        double doubt = 1.0;    ///< of area of an object that is probably out of place, 0 to 1
        double vain = 0.8;  ///< what is left of the worth of a tear after a view that did not help
        /// The same where pixels beside it had no disparity: what did not match once will hardly
        /// match from elsewhere, while what was hidden may be seen from another side.
        double vainUnmatched = 0.5;
        /// Whether sights() has a gap in view is told by the lines from it to the cameras through
        /// the known surface, all the way, in place of the depth image, and unless depth is matched
        /// how the gap faces is a hint only. For an object: the surface of a room, seen from afar,
        /// is too sparse, and lines slip through it.
        bool gapsByLine = false;
        /// Promises of what did not match are held against what came of such views before
        /// (FreeSpace::lookWorth(), RiftLedger::tryWorth()).
        bool byExperience = false;
    };

    /// Everything must outlive the scorer and stay as it is, but for the states and reasons of
    /// records (RiftLedger::giveUp(), reopen()).
    ViewScorer(const SensorModel& sensor, const SurfaceSummary& summary, const RiftLedger& ledger,
               const FreeSpace& space, double resolution, const Weights& weights);

    /// What hides what from a pose; good for any number of estimates and scores. Of this scorer,
    /// which must outlive it.
    struct Drawing;
    std::shared_ptr<const Drawing> draw(const Pose& world_T_camera) const;

    ViewScore score(const Drawing& drawing) const;
    ViewScore score(const Pose& world_T_camera) const { return score(*draw(world_T_camera)); }
    /// The same from a sample of the open cells where there are many (samples()), so that its time
    /// does not grow with them; `cells` holds those of the sample.
    ViewScore estimate(const Drawing& drawing) const;
    bool samples() const { return open_.size() > kMostOpen; }
    /// Unknown places that the view would look into.
    std::vector<Eigen::Vector3d> unknownSeen(const Pose& world_T_camera) const;
    /// Area that seeing this open cell from there would bring, hidden by nothing but what stands
    /// close before it, or with gapsByLine anywhere before its gap [m^2], and the quality of that
    /// view of it, 0 (in vain) to 1.
    struct Benefit {
        double area = 0, quality = 0;
        double torn = 0, coarse = 0;  ///< shares of what the tear and its coarse part are worth
        double coarseArea = 0;        ///< part of the area: surface known better [m^2]
    };
    Benefit benefit(const RiftRecord& record, const Pose& world_T_camera) const;
    /// Share of a tear's worth that is left after the views of it that did not help, and
    /// (byExperience) by what came of views of others like it.
    double leftAfterTries(const RiftRecord& record) const;

    /// The cells that were open when it was made, by block, then key.
    const std::vector<const RiftRecord*>& open() const { return open_; }

    /// For the choice of several views at once: what there is to see as a list of items. For every
    /// open cell its tear and its coarse surface, for every place of the frontier the surface that
    /// may be there and its being known as well as asked.
    void setFrontier(std::vector<FreeSpace::Frontier> frontier, double edge);
    const std::vector<FreeSpace::Frontier>& frontier() const { return frontier_; }
    /// Of every item [m^2].
    std::vector<float> worth() const;
    struct Seen {
        std::vector<Sight> sights;
        /// Ascending positions in `sights` of the gaps that no line was drawn to yet: they may be
        /// hidden after all.
        std::vector<std::uint32_t> gaps;
        double nearShare = 0;  ///< as in ViewScore
    };
    /// What a view would see of them. Surface known and unknown hides what lies behind it, but for
    /// gaps (gapsByLine), which only known surface hides.
    /// Thread-safe.
    Seen sights(const Pose& world_T_camera) const;
    /// What it may see of them at most, in a fraction of the time: sights() before dropHidden().
    /// Thread-safe.
    Seen sightsAtMost(const Pose& world_T_camera) const;
    /// Takes those of the gaps out of `sights` that the view does not see into, by the lines from
    /// them to its cameras; none is uncertain then. Thread-safe.
    void dropHidden(std::vector<Sight>& sights, std::vector<std::uint32_t>& gaps,
                    const Pose& world_T_camera) const;
    /// Of a cell's two items or a place's, the first.
    static bool isTear(std::uint32_t item) { return item % 2 == 0; }
    /// Index of an item's open cell in open(), or nothing.
    std::optional<std::size_t> cellOf(std::uint32_t item) const;
    /// Index of an item's place in frontier(), or nothing.
    std::optional<std::size_t> frontierOf(std::uint32_t item) const;

 private:
    static constexpr std::size_t kMostOpen = 6000;  ///< open cells that an estimate weighs

    /// What every candidate asks of an open cell, side by side: records lie anywhere in memory.
    /// Of the records as they were when the scorer was made; only tries and updates change it.
    struct OpenCell {
        const RiftRecord* record = nullptr;
        Eigen::Vector3f open;    ///< its openPosition
        Eigen::Vector3f wanted;  ///< what is to be seen: the place of its gap, if it has one
        bool hides = false;      ///< it has one
        bool tried = false;      ///< views of it were in vain
        double vain = 0;         ///< leftAfterTries()
        double torn = 0;         ///< what seeing its tear is worth [m^2]
        double coarse = 0;       ///< what seeing its coarse part well is worth [m^2]
        /// Where it is to be seen from, and what it hides; unit, or zero for any side.
        Eigen::Vector3d facing, hiddenFacing;
    };
    OpenCell openCellOf(const RiftRecord& record) const;
    Benefit benefit(const OpenCell& cell, const Pose& world_T_camera, bool withLines) const;
    ViewScore scoreEvery(std::size_t stride, int rayStride, const Drawing& drawing) const;

    struct BlockView {
        Eigen::Vector3f centre;
        float radius;
        const SurfaceSummary::Block* block;
        std::size_t firstOpen, lastOpen;  ///< range in open_
    };
    /// Blocks that lie together, so that those out of sight are passed over together.
    struct Group {
        Eigen::AlignedBox3f box;
        std::vector<std::uint32_t> blocks;  ///< indices in blocks_
    };
    struct DepthBuffer;
    using Points = decltype(SurfaceSummary::Block::positions);

    void groupBlocks();
    double newSurfaceShare(double distance) const;
    double besideRim(const SurfaceCell& cell) const;
    double nearShareOf(const DepthBuffer& buffer) const;
    bool openTo(const OpenCell& cell, const Pose& world_T_camera) const;
    template <class F>
    void forEachUnknown(const Pose& world_T_camera, const DepthBuffer& buffer, int stride,
                        const F& f) const;

    SensorModel sensor_;
    const SurfaceSummary* summary_;
    const FreeSpace* space_;
    const RiftLedger* ledger_;
    Weights weights_;
    double resolution_;
    double goodDepth_;
    std::vector<BlockView> blocks_;
    std::vector<Group> groups_;
    std::vector<const RiftRecord*> open_;  ///< by block, then key
    std::vector<OpenCell> openCells_;      ///< of open_
    std::vector<FreeSpace::Frontier> frontier_;
    Points frontierCentres_;
    double frontierEdge_ = 0;  ///< of its voxels [m]
};

}  // namespace riftmap
