// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/img/TStereoCamera.h>
#include <mrpt/obs/CObservationStereoImages.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "riftmap/core/options.h"
#include "riftmap/core/tum.h"
#include "riftmap/core/view.h"
#include "riftmap/sim/simulated_platform.h"
#include "riftmap/sim/trajectory.h"

namespace riftmap {

/// What a simulated recording is made from: [World] [Camera] [Noise] [Render] [Trajectory]
/// [PoseNoise].
struct SimulatedViewsOptions {
    WorldOptions world;
    CameraOptions camera;
    NoiseOptions noise;
    RenderOptions render;
    TrajectoryOptions trajectory;
    PoseNoiseOptions poseNoise;
    void describe(OptionTable& table);
};

/// The views that a camera on a given trajectory has of a world. For riftmap-simulate and for the
/// sensor plug-in of rawlog-grabber: the same options and seed give both the same observations.
class SimulatedViews {
 public:
    /// Throws ConfigError, MeshError, FileError.
    SimulatedViews(const SimulatedViewsOptions& options, std::uint64_t seed);

    std::size_t count() const { return truth_.size(); }
    /// View i with the pose that the rig believes in; still distorted if the lens is.
    StereoObservation observation(std::size_t i) const;
    /// A view as MRPT's observation, the lens's distortion in its calibration.
    mrpt::obs::CObservationStereoImages::Ptr pair(const StereoObservation& observation) const;

    const World& world() const { return world_; }
    const StereoRenderer& renderer() const { return *renderer_; }
    const std::vector<TimedPose>& truth() const { return truth_; }  ///< of the left camera
    mrpt::img::TStereoCamera calibration() const;

 private:
    SimulatedViewsOptions options_;
    std::uint64_t seed_;
    World world_;
    RayCaster caster_;
    std::unique_ptr<StereoRenderer> renderer_;
    std::vector<TimedPose> truth_, believed_;
};

}  // namespace riftmap
