// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>

#include "riftmap/apps/program.h"
#include "riftmap/sim/simulated_platform.h"
#include "riftmap/sim/trajectory.h"

namespace riftmap {

/// riftmap-simulate: world + trajectory -> rawlog with ground truth.
class SimulateProgram : public Program {
 public:
    SimulateProgram();
    void run() override;

    std::size_t views = 0;  ///< written by run()

 protected:
    void describe(OptionTable& table) override;

 private:
    void checkOutputs() const;
    void writeCalibration(const std::filesystem::path& file) const;
    std::filesystem::path beside(const char* suffix) const;

    WorldOptions world_;
    CameraOptions camera_;
    NoiseOptions noise_;
    RenderOptions render_;
    TrajectoryOptions trajectory_;
    PoseNoiseOptions poseNoise_;
    bool external_ = true;
    bool truthImages_ = false;
};

}  // namespace riftmap
