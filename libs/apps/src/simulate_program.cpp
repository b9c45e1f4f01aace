// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/simulate_program.h"

#include <mrpt/config/CConfigFileMemory.h>
#include <mrpt/img/TStereoCamera.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "riftmap/apps/rawlog_writer.h"
#include "riftmap/core/file.h"
#include "riftmap/core/pfm.h"
#include "riftmap/core/progress.h"
#include "riftmap/core/tum.h"

namespace riftmap {
namespace {

mrpt::img::TStereoCamera calibrationOf(const CameraOptions& options) {
    const StereoCamera camera = options.camera();
    mrpt::img::TStereoCamera calibration;
    for (auto* side : {&calibration.leftCamera, &calibration.rightCamera}) {
        side->ncols = static_cast<std::uint32_t>(camera.width);
        side->nrows = static_cast<std::uint32_t>(camera.height);
        side->setIntrinsicParamsFromValues(camera.fx, camera.fy, camera.cx, camera.cy);
        std::vector<double> d = options.distortion;
        d.resize(5, 0.0);
        side->setDistortionPlumbBob(d[0], d[1], d[2], d[3], d[4]);
        if (!options.distorted()) {
            side->distortion = mrpt::img::DistortionModel::none;
        }
    }
    calibration.rightCameraPose = {camera.baseline, 0, 0, 1, 0, 0, 0};
    return calibration;
}

/// depth_N.pfm [m] and disparity_N.pfm [px], half-occluded pixels included.
void writeTruth(const StereoRenderer& renderer, const Pose& pose,
                const std::filesystem::path& folder, std::size_t view) {
    const cv::Mat depth = renderer.truth(pose, false, false).depth;
    FloatImage image{depth.cols, depth.rows, {depth.begin<float>(), depth.end<float>()}};
    const std::string number = std::to_string(view) + ".pfm";
    writePfm(folder / ("depth_" + number), image);
    for (float& value : image.values) {
        value = std::isfinite(value)
                    ? static_cast<float>(renderer.camera().disparity(static_cast<double>(value)))
                    : kNoDisparity;
    }
    writePfm(folder / ("disparity_" + number), image);
}

}  // namespace

SimulateProgram::SimulateProgram()
    : Program("riftmap-simulate",
              "Carries a simulated stereo camera through a world and records a rawlog.",
              Config::kOptional) {}

void SimulateProgram::describe(OptionTable& table) {
    world_.describe(table);
    camera_.describe(table);
    noise_.describe(table);
    render_.describe(table);
    trajectory_.describe(table);
    poseNoise_.describe(table);
    table.section("Record", "What is written.");
    table.add("external_images", external_,
              "Images as PNG files in NAME_Images beside NAME.rawlog; otherwise inside it.");
    table.add("truth_images", truthImages_,
              "Exact depth and disparity of every view as PFM files in NAME_truth.");
}

std::filesystem::path SimulateProgram::beside(const char* suffix) const {
    return out().parent_path() / (out().stem().string() + suffix);
}

void SimulateProgram::checkOutputs() const {
    if (requiredOut().extension() != ".rawlog") {
        throw ConfigError("--out " + out().string() + ": the name must end in .rawlog");
    }
    if (std::filesystem::exists(out()) && !overwrite()) {
        throw ConfigError(out().string() + ": exists already; -w overwrites it");
    }
    if (camera_.distorted() && noise_.level != NoiseOptions::Level::kN4) {
        throw ConfigError("Camera.distortion: only Noise.level = N4 has lenses");
    }
}

void SimulateProgram::writeCalibration(const std::filesystem::path& file) const {
    mrpt::config::CConfigFileMemory ini;
    calibrationOf(camera_).saveToConfigFile("CAMERA", ini);
    writeAtomically(file, [&](std::ostream& stream) { stream << ini.getContent(); });
}

void SimulateProgram::run() {
    checkOutputs();
    const World world = makeWorld(world_);
    const RayCaster caster(world.mesh);
    const StereoRenderer renderer(world, caster, camera_, render_);
    const auto truth = makeTrajectory(trajectory_, world, caster);
    const auto believed = withPoseNoise(truth, poseNoise_, seed());

    if (!out().parent_path().empty()) {
        std::filesystem::create_directories(out().parent_path());
    }
    RawlogWriter writer(
        out(), external_ ? RawlogWriter::Images::kExternal : RawlogWriter::Images::kEmbedded);
    writer.comment(truth.front().time_ns, "[dataset]\nkind = synthetic\nworld = " + world.name +
                                              "\nseed = " + std::to_string(seed()) + "\n");
    const std::filesystem::path truthFolder = beside("_truth");
    if (truthImages_) {
        std::filesystem::create_directories(truthFolder);
    }
    Progress bar("simulating", "views", truth.size(), progress());
    for (std::size_t i = 0; i < truth.size(); ++i) {
        StereoObservation observation =
            observe(renderer, camera_, noise_, truth[i].pose, viewSeed(seed(), i));
        observation.time_ns = truth[i].time_ns;
        observation.world_T_camera = believed[i].pose;
        if (camera_.distorted()) {
            auto pair = toMrpt(observation, forwardCamera(), "stereo");
            pair->setStereoCameraParams(calibrationOf(camera_));
            writer.robotPose(observation.time_ns,
                             observation.world_T_camera * forwardCamera().inverse());
            writer.pair(*pair);
        } else {
            writer.write(observation);
        }
        if (truthImages_) {
            writeTruth(renderer, truth[i].pose, truthFolder, i);
        }
        bar.update(i + 1);
    }
    writer.finish();
    writeTum(beside("_gt.tum"), truth);
    writeCalibration(beside("_calibration.ini"));
    views = truth.size();
    std::printf("%s: %zu views of %s, %dx%d px, baseline %g m\n", out().string().c_str(), views,
                world.name.c_str(), camera_.width, camera_.height, camera_.baseline);
}

}  // namespace riftmap
