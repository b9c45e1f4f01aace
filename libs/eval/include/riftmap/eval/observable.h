// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "riftmap/core/platform.h"
#include "riftmap/core/progress.h"
#include "riftmap/eval/eval_options.h"
#include "riftmap/eval/samples.h"
#include "riftmap/sim/ray_caster.h"

namespace riftmap {

/// Where a camera may be and how far it sees: what "observable" is relative to.
struct ViewSpace {
    Eigen::Vector3d boxMin = Eigen::Vector3d::Zero(), boxMax = Eigen::Vector3d::Zero();  ///< [m]
    Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< camera positions connect to it [m]
    double clearance = 0.2;                           ///< to any surface [m]
    double nearLimit = 0, farLimit = 1e3;             ///< distance of a measured surface [m]
    /// Elevation of the line of sight above the horizon [rad]: any, for a free-flying camera.
    double minElevation = -1.6, maxElevation = 1.6;
};

/// The view space of a platform. The line of sight of a ground platform reaches half the vertical
/// field of view beyond its tilt.
ViewSpace viewSpaceOf(const PlatformLimits& limits, const StereoCamera& camera,
                      const Eigen::Vector3d& start);

/// Positions of the camera: a grid over the box, flooded from the start. A node is reachable if a
/// chain of grid steps that keep the clearance all along leads to it.
class ReachableSpace {
 public:
    /// Throws std::runtime_error if the start is outside the box, nearer than the clearance to a
    /// surface, or in a nook from which no node of the grid can be reached. `grid` [m]; 0 = half
    /// the clearance within [0.02, 0.1]; it grows where the box would take more than 2^24 nodes.
    ReachableSpace(const RayCaster& caster, const ViewSpace& space, double grid);

    double grid() const { return grid_; }
    std::size_t nodeCount() const { return reachable_.size(); }
    std::size_t reachableCount() const;
    struct Room {
        bool certain = false;  ///< the place is reachable, by what is known at the nearest node
        float estimate = 0;    ///< clearance to be expected [m]; 0: nothing reachable is near
    };
    /// What the grid alone says about a place: quick.
    Room room(const Eigen::Vector3d& place) const;
    /// True if a straight way with the clearance leads from the place to one of the reachable
    /// nodes around it: exact, slow.
    bool contains(const Eigen::Vector3d& place) const;
    /// Calls f(position) for each reachable node, in order.
    template <class F>
    void forEach(F&& f) const {
        for (std::size_t i = 0; i < reachable_.size(); ++i) {
            if (reachable_[i] != 0) {
                f(position(i));
            }
        }
    }

 private:
    Eigen::Vector3d position(std::size_t node) const;
    std::ptrdiff_t nearestNode(const Eigen::Vector3d& place) const;
    bool stepClear(std::size_t a, std::size_t b) const;
    template <class F>
    bool anyNodeAround(const Eigen::Vector3d& place, F&& f) const;
    void markNeighbours();
    void flood(std::vector<std::size_t> queue);

    const RayCaster* caster_;
    ViewSpace space_;
    double grid_;
    Eigen::Vector3d origin_;
    Eigen::Vector3i size_;
    std::vector<float> distance_;  ///< to the nearest surface, capped [m]
    std::vector<std::uint8_t> reachable_;
    std::vector<std::uint8_t> beside_;  ///< reachable, or one of the 26 nodes around is
};

/// Which samples some pose of the view space can see.
struct ObservableSet {
    std::vector<std::uint8_t> observable;  ///< 0 or 1, a sample
    /// Unit normal on the side that is seen (the mesh's own side if both or none are).
    std::vector<Eigen::Vector3f> normals;
    std::size_t count = 0;
    double grid = 0;        ///< of the camera positions [m]
    std::uint64_t key = 0;  ///< hash of world, samples, view space and version of the method
    bool fromCache = false;
};

/// Rays go from each sample outwards; a sample is observable if one meets a reachable camera
/// position within the range before it meets a surface. Then, until nothing changes, samples not
/// seen yet are tried from the positions that see their neighbours (narrow views). Exact ray
/// casting; a yes is certain, a no is as fine as `directions`. Same result for any number of
/// threads. Reads and writes options.cache. In a building of two million samples it takes minutes:
/// `progress`, if any, is told from time to time, not if the set is in the cache.
ObservableSet observableSet(const RayCaster& caster, const ViewSpace& space,
                            const SurfaceSamples& samples, const EvalOptions& options,
                            const OnProgress& progress = {});

}  // namespace riftmap
