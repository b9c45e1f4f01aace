// SPDX-License-Identifier: BSD-3-Clause
// Other ways to choose the next view, to compare with. Map frame, metres, radians.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "riftmap/core/camera.h"
#include "riftmap/core/options.h"
#include "riftmap/core/platform.h"
#include "riftmap/core/pose.h"

namespace riftmap {

/// What a view source is told after each view.
struct BaselineState {
    Pose pose;  ///< of the last view
    StereoCamera camera;
    PlatformLimits limits;
    std::span<const Eigen::Vector3f> cloud;  ///< what the last view measured, map frame [m]
    /// True if the camera can move straight from a to b with its clearance. The baselines get this
    /// from the true world: they are spared what exploring planners must find out.
    std::function<bool(const Eigen::Vector3d& a, const Eigen::Vector3d& b)> segmentClear;
};

/// Section [Baseline].
struct BaselineOptions {
    int views = 0;          ///< of orbit and sphere; 0 = 10 (sphere), 24 (orbit)
    double radius = 0;      ///< of orbit and sphere [m]; 0 = the target fills the image
    double spacing = 1.5;   ///< between the stops of the lawn-mower [m]
    double resolution = 0;  ///< of the OctoMap [m]; 0 = 10 cm, with a target 1/25 of its side
    double minGain = 0.01;  ///< octomap_frontier ends below this share of a full view's voxels
    int poses = 20000;      ///< that foresight picks from
    void describe(OptionTable& table);
};

/// A way to choose views. Not thread-safe; the same calls give the same answers.
class ViewSource {
 public:
    virtual ~ViewSource() = default;
    /// The way to the next view: poses to move through, straight from one to the next; the last is
    /// the view. Nothing when it has no more views to offer.
    virtual std::optional<std::vector<Pose>> next(const BaselineState& state) = 0;
};

/// The baselines' names: "random", "orbit", "lawnmower", "sphere", "octomap_frontier".
const std::vector<std::string>& baselineNames();

/// `target`: box of the object to look at; empty where the camera is inside what it maps.
/// - random: places and directions at random (at points of the target where there is one);
/// - orbit: circles at three heights round the target, or round the middle of the workspace
///   looking outwards;
/// - lawnmower: stops on rows through the workspace, six directions at each;
/// - sphere: places spread evenly over a sphere round the target, in a short tour;
/// - octomap_frontier: the view that looks into most frontier voxels (unknown beside free) of an
///   OctoMap of all clouds so far, those beside surface counting ten times, per second of path at
///   1 m/s and 1 s a view; a voxel that stays frontier after two views meant to see it is given up.
/// Throws std::invalid_argument for another name, and for `sphere` without a target.
std::unique_ptr<ViewSource> makeBaseline(const std::string& name, const BaselineOptions& options,
                                         const Eigen::AlignedBox3d& target, std::uint64_t seed);

class CoverageJudge;
class RayCaster;

/// Not a way to explore but a measure of how well one can: knows the surface, and takes, of
/// `options.poses` poses at random that the camera can reach, always the one that shows most of the
/// judge's observable samples that no view has shown (20,000 of them at most); greedy maximum
/// coverage, which no choice of as many of these views betters by more than 1 / (1 - 1/e)
/// (Nemhauser, Wolsey & Fisher, Math. Programming 14, 1978). Ends when none shows any. Ways do not
/// count. `judge` and `caster` must outlive it. The first call takes seconds, and some 10 kB a
/// pose.
std::unique_ptr<ViewSource> makeForesight(const CoverageJudge& judge, const RayCaster& caster,
                                          const BaselineOptions& options, std::uint64_t seed);

/// A way from a to b inside the limits' box over a lattice of `step` [m], shortened; a is left out,
/// b is the last. Nothing if there is none after `maxNodes` of the lattice.
std::optional<std::vector<Eigen::Vector3d>> findWay(const BaselineState& state,
                                                    const Eigen::Vector3d& a,
                                                    const Eigen::Vector3d& b, double step = 0.25,
                                                    std::size_t maxNodes = 20000);

}  // namespace riftmap
