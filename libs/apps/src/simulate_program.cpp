// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/simulate_program.h"

#include <mrpt/config/CConfigFileMemory.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "riftmap/apps/rawlog_writer.h"
#include "riftmap/core/file.h"
#include "riftmap/core/pfm.h"
#include "riftmap/core/progress.h"
#include "riftmap/core/tum.h"

namespace riftmap {
namespace {

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

void writeCalibration(const mrpt::img::TStereoCamera& calibration,
                      const std::filesystem::path& file) {
    mrpt::config::CConfigFileMemory ini;
    calibration.saveToConfigFile("CAMERA", ini);
    writeAtomically(file, [&](std::ostream& stream) { stream << ini.getContent(); });
}

}  // namespace

SimulateProgram::SimulateProgram()
    : Program("riftmap-simulate",
              "Carries a simulated stereo camera through a world and records a rawlog.",
              Config::kOptional) {}

void SimulateProgram::describe(OptionTable& table) {
    options_.describe(table);
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
}

void SimulateProgram::writeRawlog(const SimulatedViews& recording) {
    RawlogWriter writer(
        out(), external_ ? RawlogWriter::Images::kExternal : RawlogWriter::Images::kEmbedded);
    writer.comment(recording.truth().front().time_ns,
                   "[dataset]\nkind = synthetic\nworld = " + recording.world().name +
                       "\nseed = " + std::to_string(seed()) + "\n");
    if (truthImages_) {
        std::filesystem::create_directories(beside("_truth"));
    }
    Progress bar("simulating", "views", recording.count(), progress());
    for (std::size_t i = 0; i < recording.count(); ++i) {
        const StereoObservation view = recording.observation(i);
        writer.robotPose(view.time_ns, view.world_T_camera * forwardCamera().inverse());
        writer.pair(*recording.pair(view));
        if (truthImages_) {
            writeTruth(recording.renderer(), recording.truth()[i].pose, beside("_truth"), i);
        }
        bar.update(i + 1);
    }
    writer.finish();
}

void SimulateProgram::run() {
    checkOutputs();
    const SimulatedViews recording(options_, seed());
    if (!out().parent_path().empty()) {
        std::filesystem::create_directories(out().parent_path());
    }
    writeRawlog(recording);
    writeTum(beside("_gt.tum"), recording.truth());
    writeCalibration(recording.calibration(), beside("_calibration.ini"));
    views = recording.count();
    const CameraOptions& camera = options_.camera;
    std::printf("%s: %zu views of %s, %dx%d px, baseline %g m\n", out().string().c_str(), views,
                recording.world().name.c_str(), camera.width, camera.height, camera.baseline);
}

}  // namespace riftmap
