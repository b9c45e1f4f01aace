// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/simulated_views.h"

#include "riftmap/apps/rawlog_writer.h"

namespace riftmap {

void SimulatedViewsOptions::describe(OptionTable& table) {
    world.describe(table);
    camera.describe(table);
    noise.describe(table);
    render.describe(table);
    trajectory.describe(table);
    poseNoise.describe(table);
}

SimulatedViews::SimulatedViews(const SimulatedViewsOptions& options, std::uint64_t seed)
    : options_(options), seed_(seed), world_(makeWorld(options.world)), caster_(world_.mesh) {
    if (options.camera.distorted() && options.noise.level != NoiseOptions::Level::kN4) {
        throw ConfigError("Camera.distortion: only Noise.level = N4 has lenses");
    }
    renderer_ = std::make_unique<StereoRenderer>(world_, caster_, options.camera, options.render);
    truth_ = makeTrajectory(options.trajectory, world_, caster_);
    believed_ = withPoseNoise(truth_, options.poseNoise, seed);
}

StereoObservation SimulatedViews::observation(std::size_t i) const {
    StereoObservation observation =
        observe(*renderer_, options_.camera, options_.noise, truth_[i].pose, viewSeed(seed_, i));
    observation.time_ns = truth_[i].time_ns;
    observation.world_T_camera = believed_[i].pose;
    return observation;
}

mrpt::obs::CObservationStereoImages::Ptr SimulatedViews::pair(
    const StereoObservation& observation) const {
    auto pair = toMrpt(observation, forwardCamera(), "stereo");
    if (options_.camera.distorted()) {
        pair->setStereoCameraParams(calibration());
    }
    return pair;
}

mrpt::img::TStereoCamera SimulatedViews::calibration() const {
    const StereoCamera camera = options_.camera.camera();
    std::vector<double> d = options_.camera.distortion;
    d.resize(5, 0.0);
    mrpt::img::TStereoCamera calibration;
    for (auto* side : {&calibration.leftCamera, &calibration.rightCamera}) {
        side->ncols = static_cast<std::uint32_t>(camera.width);
        side->nrows = static_cast<std::uint32_t>(camera.height);
        side->setIntrinsicParamsFromValues(camera.fx, camera.fy, camera.cx, camera.cy);
        if (options_.camera.distorted()) {
            side->setDistortionPlumbBob(d[0], d[1], d[2], d[3], d[4]);
        }
    }
    calibration.rightCameraPose = {camera.baseline, 0, 0, 1, 0, 0, 0};
    return calibration;
}

}  // namespace riftmap
