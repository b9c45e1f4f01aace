// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/simulated_sensor.h"

#include <mrpt/core/initializer.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationRobotPose.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "riftmap/apps/rawlog_writer.h"
#include "riftmap/core/mrpt_time.h"

IMPLEMENTS_GENERIC_SENSOR(SimulatedStereoSensor, riftmap)

MRPT_INITIALIZER(registerSimulatedStereoSensor) {
    riftmap::SimulatedStereoSensor::doRegister();
}

namespace riftmap {

void SimulatedStereoSensor::loadConfig_sensorSpecific(const mrpt::config::CConfigFileBase& config,
                                                      const std::string& section) {
    OptionTable table;
    options_.describe(table);
    // A file of riftmap-simulate may say what to write; that is rawlog-grabber's business here.
    bool ignored = false;
    table.section("Record", "Without effect.");
    table.add("external_images", ignored, "Without effect.");
    table.add("truth_images", ignored, "Without effect.");
    const std::string file = config.read_string(section, "simulation", "");
    if (!file.empty()) {
        table.load(file);
    }
    seed_ = config.read_uint64_t(section, "seed", 0);
    std::vector<std::string> keys;
    config.getAllKeys(section, keys);
    for (const std::string& key : keys) {
        if (key.find('.') != std::string::npos) {
            table.set(key + "=" + config.read_string(section, key, ""));
        }
    }
}

void SimulatedStereoSensor::initialize() {
    recording_ = std::make_unique<SimulatedViews>(options_, seed_);
    next_ = 0;
    saidGoodbye_ = false;
    m_state = ssWorking;
}

void SimulatedStereoSensor::setPathForExternalImages(const std::string& directory) {
    std::filesystem::create_directories(directory);
    m_path_for_external_images = directory;
}

void SimulatedStereoSensor::moveOut(mrpt::img::CImage& image, const char* side,
                                    std::int64_t time_ns) const {
    const std::string name =
        m_sensorLabel + "_" + side + "_" + std::to_string(time_ns) + "." + m_external_images_format;
    const std::string file = (std::filesystem::path(m_path_for_external_images) / name).string();
    if (!cv::imwrite(file, image.asCvMatRef())) {
        throw std::runtime_error(file + ": cannot be written");
    }
    image.setExternalStorage(name);
}

/// rawlog-grabber keeps the last object of all back and loses it at its end: let it be this one.
void SimulatedStereoSensor::sayGoodbye() {
    if (saidGoodbye_) {
        return;
    }
    saidGoodbye_ = true;
    auto note = mrpt::obs::CObservationComment::Create();
    note->sensorLabel = "end";
    note->timestamp = toMrptTime(recording_->truth().back().time_ns + 1'000'000);
    note->text = "end of the simulated journey";
    appendObservation(note);
}

void SimulatedStereoSensor::doProcess() {
    if (next_ >= recording_->count()) {
        sayGoodbye();
        return;
    }
    const StereoObservation view = recording_->observation(next_++);
    auto pose = mrpt::obs::CObservationRobotPose::Create();
    pose->sensorLabel = "pose";
    pose->timestamp = toMrptTime(view.time_ns);
    pose->pose.mean = toMrpt(view.world_T_camera * forwardCamera().inverse());
    const auto pair = recording_->pair(view);
    pair->sensorLabel = m_sensorLabel;
    if (!m_path_for_external_images.empty()) {
        moveOut(pair->imageLeft, "L", view.time_ns);
        if (pair->hasImageRight) {
            moveOut(pair->imageRight, "R", view.time_ns);
        }
    }
    appendObservations({pose, pair});
}

}  // namespace riftmap
