// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "riftmap/core/pose.h"
#include "riftmap/planner/free_space.h"
#include "riftmap/planner/rift_ledger.h"
#include "riftmap/planner/sensor_model.h"
#include "riftmap/planner/surface_summary.h"

namespace riftmap {

/// What a view from some pose would bring.
struct ViewScore {
    double gain = 0;                   ///< surface that it may add or make better, about [m^2]
    double openGain = 0;               ///< part of it: tears closed
    double unknownGain = 0;            ///< part of it: unknown space looked into
    double nearShare = 0;              ///< of the field of view that is nearer than the near limit
    std::vector<std::uint64_t> cells;  ///< open cells that it sees well, ascending
};

/// Predicts views: the cells of the summary are drawn into a small depth image, which hides what
/// lies behind them; then open cells and unknown space are counted. score() is thread-safe.
class ViewScorer {
 public:
    struct Weights {
        double unknown = 1.0;  ///< of unknown area against that at tears
        double reach = 1.5;    ///< width of the strip that closing a tear brings, in cells ...
        double farthestReach = 4.0;  ///< ... and beyond deep steps at most
        double coarse = 0.35;        ///< of surface known better against surface known at all
    };

    /// Everything must outlive the scorer and stay as it is.
    ViewScorer(const SensorModel& sensor, const SurfaceSummary& summary, const RiftLedger& ledger,
               const FreeSpace& space, double resolution, const Weights& weights);

    ViewScore score(const Pose& world_T_camera) const;
    /// Unknown places that the view would look into.
    std::vector<Eigen::Vector3d> unknownSeen(const Pose& world_T_camera) const;
    /// Area that seeing this open cell from there would bring, without occlusion [m^2], and the
    /// quality of that view of it, 0 (in vain) to 1.
    struct Benefit {
        double area = 0, quality = 0;
    };
    Benefit benefit(const RiftRecord& record, const Eigen::Vector3d& eye) const;

    const std::vector<const RiftRecord*>& open() const { return open_; }

 private:
    struct BlockView {
        Eigen::Vector3f centre;
        float radius;
        const SurfaceSummary::Block* block;
        std::size_t firstOpen, lastOpen;  ///< range in open_
    };
    struct DepthBuffer;

    DepthBuffer draw(const Pose& camera_T_world, std::vector<const BlockView*>& seen) const;
    template <class F>
    void forEachUnknown(const Pose& world_T_camera, const DepthBuffer& buffer, const F& f) const;

    SensorModel sensor_;
    const SurfaceSummary* summary_;
    const RiftLedger* ledger_;
    const FreeSpace* space_;
    Weights weights_;
    double goodDepth_;
    std::vector<BlockView> blocks_;
    std::vector<const RiftRecord*> open_;  ///< by block, then key
};

}  // namespace riftmap
