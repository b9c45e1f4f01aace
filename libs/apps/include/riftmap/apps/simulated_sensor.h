// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/hwdrivers/CGenericSensor.h>

#include <cstddef>
#include <memory>
#include <string>

#include "riftmap/apps/simulated_views.h"

namespace riftmap {

/// The simulated stereo camera as a sensor of MRPT, so that an unmodified rawlog-grabber records
/// it: `rawlog-grabber -p libriftmap-sim-sensor.so apps/riftmap-simulate/rawlog-grabber.ini`.
/// Its section takes
///
///     driver        = SimulatedStereoSensor
///     process_rate  = 10               // [Hz] views a second of real time
///     simulation    = worlds/room.ini  // a configuration of riftmap-simulate, or none
///     seed          = 0
///     World.name    = room             // any Section.key of riftmap-simulate; wins over the file
///
/// and gives what riftmap-simulate writes: a CObservationRobotPose (label "pose") and a
/// CObservationStereoImages (the section's sensorLabel), a view each call, then nothing more.
class SimulatedStereoSensor : public mrpt::hwdrivers::CGenericSensor {
    DEFINE_GENERIC_SENSOR(SimulatedStereoSensor)

 public:
    void initialize() override;
    void doProcess() override;
    void setPathForExternalImages(const std::string& directory) override;

 protected:
    /// Throws ConfigError.
    void loadConfig_sensorSpecific(const mrpt::config::CConfigFileBase& config,
                                   const std::string& section) override;

 private:
    void sayGoodbye();
    void moveOut(mrpt::img::CImage& image, const char* side, std::int64_t time_ns) const;

    SimulatedViewsOptions options_;
    std::uint64_t seed_ = 0;
    std::unique_ptr<SimulatedViews> recording_;
    std::size_t next_ = 0;
    bool saidGoodbye_ = false;
};

}  // namespace riftmap
