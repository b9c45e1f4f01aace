// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "riftmap/core/options.h"
#include "riftmap/core/platform.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/free_space.h"
#include "riftmap/planner/object_memory.h"
#include "riftmap/planner/rift_ledger.h"
#include "riftmap/planner/sensor_model.h"
#include "riftmap/planner/surface_summary.h"
#include "riftmap/planner/view_scorer.h"

namespace riftmap {

/// Section [Planner].
struct PlannerOptions {
    double cellSize = 0;    ///< of the surface summary [m]; 0 = 4 target resolutions
    double voxelSize = 0;   ///< of the free space [m]; 0 = by the workspace
    double viewCost = 4.0;  ///< what taking a view costs, in metres of path
    double minGain = 0;     ///< a view that promises less than this share of the surface is not
                            ///< worth it; 0: by the depth, see Knowledge::minGain()
    int maxAttempts = 4;    ///< views of a tear that may fail before it is given up
    double unknownWeight = 0.5;     ///< of unknown space looked into, against tears to be closed
    double newSurfaceDepth = 1.5;   ///< good depths up to which new surface counts in full; 0: as
                                    ///< far as it is within the resolution of where it should be
    double clearanceMargin = 0.02;  ///< beyond the platform's clearance [m]
    int targets = 48;               ///< tears that candidates are made for, in one plan
    int places = 24;                ///< places for candidates that aim at no tear, in one plan
    int candidates = 100;           ///< views of tears that are scored, in one plan
    /// Surfaces lie in this box, the space around it is free: xmin ymin zmin xmax ymax zmax [m].
    /// Empty: nothing is known beforehand.
    std::vector<double> surfaceBox;
    bool backgroundIsFree =
        false;  ///< pixels without a match show that nothing is there, as far as both cameras see
    std::uint64_t seed = 0;  ///< of the candidates; the program sets it
    void describe(OptionTable& table);
};

/// What the run knows so far: the map and what follows from it. Map frame, metres.
class Knowledge {
 public:
    Knowledge(const PixelGraph& graph, const PlatformLimits& limits, const PlannerOptions& options);

    /// Takes in a view that was just merged into the graph.
    void update(const View& view);
    /// Notes what came of looks into the unknown from these places on, after update() with the view
    /// that was taken to look there.
    void noteLooks(const View& view, const std::vector<Eigen::Vector3d>& places);
    /// Ways from where the camera is.
    void updateReach();
    /// Looks for passages too narrow for voxels (a door, the space between a wall and the end of
    /// the workspace), by the surface itself. If they lead on, to 0.2 % more voxels at least, takes
    /// them into account from then on, and opens again the tears that were unreachable. True if
    /// they do; false if they did before, if there are no 0.2 % more clear voxels anywhere (no look
    /// is taken then), or if the last look was less than 20 views ago and it is not `atTheEnd`.
    bool openPassages(bool atTheEnd);
    /// Clear voxels (their centre keeps the clearance, without passages) that the last
    /// updateReach() found a way to.
    std::size_t reached() const { return reached_; }
    /// A place where the camera fits, and the way there.
    struct Place {
        Eigen::Vector3d eye;
        double path = 0;  ///< length of the way there [m]
    };
    /// The place itself if it is where the camera is, or lies between voxels but nearer to the
    /// surface than their centres may; else the middle of its voxel. Nothing if it is not known to
    /// be reachable. Thread-safe while nothing changes.
    std::optional<Place> placeAt(const Eigen::Vector3d& eye) const;

    const PixelGraph& graph() const { return *graph_; }
    const PlatformLimits& limits() const { return limits_; }
    const PlannerOptions& options() const { return options_; }
    double clearance() const { return limits_.clearance + options_.clearanceMargin; }
    /// True as long as hardly a voxel can be reached: at first, where the camera has to find a way
    /// out of its place.
    bool confined() const { return reached_ < kFew; }
    static constexpr std::size_t kFew = 64;  ///< [voxels]
    /// Voxels whose centre is nearer to a camera that takes a view than this are free, for it is
    /// there [m]: those that lie within its clearance as a whole. While it is confined two voxels
    /// more than its clearance are taken to be free, or it could not take the first step without
    /// having looked straight up and down. (Not later: it would free its way into what no view
    /// saw, step by step.)
    double freeAround() const {
        const double voxel = space_.voxelSize();
        return limits_.clearance + (confined() ? 2.2 : -std::sqrt(0.75)) * voxel;
    }
    const SensorModel& sensor() const { return sensor_; }
    const SurfaceSummary& summary() const { return summary_; }
    const FreeSpace& space() const { return space_; }
    FreeSpace& space() { return space_; }
    /// Where to look for surface that was not seen yet: a finer grid over the surfaces' box if that
    /// was declared, else space().
    const FreeSpace& unseen() const { return hull_ ? *hull_ : space_; }
    FreeSpace& unseen() { return hull_ ? *hull_ : space_; }
    const RiftLedger& ledger() const { return ledger_; }
    RiftLedger& ledger() { return ledger_; }
    const Pose& camera() const { return camera_; }
    std::size_t views() const { return views_; }
    /// Where the camera may be: the workspace within the platform's range of heights.
    const Eigen::AlignedBox3d& cameraBox() const { return cameraBox_; }
    bool tiltAllowed(const Pose& pose) const;
    /// Box of the surfaces, if it was declared.
    const std::optional<Eigen::AlignedBox3d>& surfaceBox() const { return surfaceBox_; }
    /// What a view has to promise to be worth it [m^2]: PlannerOptions::minGain of the surface
    /// known, or if that is 0 a share of 0.0004, with exact depth 0.0001, with
    /// DepthKind::kPixelwise 0.0007; where the box of the surfaces is known 0.0003, 0.0004 and
    /// 0.00048; then of no more surface than fills ten images at the far limit, so that large
    /// buildings are mapped as completely as small ones. (Surface counts by the faces of its cells
    /// there, about 1.5 times its area: SurfaceSummary::area().)
    double minGain() const;
    /// True if this place was seen through and no surface of the map is within the platform's
    /// clearance, whether or not a way there is known. Thread-safe while nothing changes.
    bool mayBeAt(const Eigen::Vector3d& place) const;
    double resolution() const { return graph_->options().targetResolution; }
    /// Poses from the camera to a reachable place, turning evenly on the way; the goal last.
    std::vector<Pose> pathTo(const Pose& goal) const;

 private:
    void updateSurface(FreeSpace& space) const;
    bool fits(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;
    bool fitsBetweenVoxels(const Eigen::Vector3d& centre) const;

    const PixelGraph* graph_;
    PlatformLimits limits_;
    PlannerOptions options_;
    std::optional<Eigen::AlignedBox3d> surfaceBox_;
    Eigen::AlignedBox3d cameraBox_;
    SensorModel sensor_;
    SeenThrough seenThrough_;
    SurfaceSummary summary_;
    FreeSpace space_;
    std::optional<FreeSpace> hull_;
    RiftLedger ledger_;
    Pose camera_;
    bool passages_ = false;
    std::size_t nextLook_ = 0;                          ///< for passages [views]
    std::size_t reached_ = 0;                           ///< clear voxels
    Eigen::Vector3d anchor_ = Eigen::Vector3d::Zero();  ///< where ways over voxels begin
    std::size_t views_ = 0;
};

/// Where to go next.
struct ViewPlan {
    std::vector<Pose> path;                ///< last: where the view is to be taken
    double gain = 0;                       ///< expected [m^2]
    double tearGain = 0;                   ///< part of it: tears closed
    double coarseGain = 0;                 ///< part of it: surface known better
    double unknownGain = 0;                ///< part of it: unknown space looked into
    std::vector<std::uint64_t> cells;      ///< tears that the view is to close
    std::vector<Eigen::Vector3d> unknown;  ///< unknown places that it is to look into
};

/// Chooses views. Not thread-safe.
class ViewPlanner {
 public:
    virtual ~ViewPlanner() = default;
    virtual std::string name() const = 0;
    /// The next view; nothing if no view is worth it any more. May give tears up in the ledger.
    virtual std::optional<ViewPlan> next(Knowledge& knowledge) = 0;
    /// Why next() gave none, as a run's stop reason.
    virtual std::string whyNone() const { return "complete"; }
};

/// The default planner: views that bring most for their way (see doc/explorer.md).
class RiftPlanner : public ViewPlanner {
 public:
    std::string name() const override { return "riftmap"; }
    std::optional<ViewPlan> next(Knowledge& knowledge) override;

 private:
    std::vector<Pose> pool_;  ///< good views that were not taken yet
    ObjectMemory memory_;
};

}  // namespace riftmap
