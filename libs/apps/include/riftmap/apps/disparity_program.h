// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "riftmap/apps/program.h"
#include "riftmap/stereo/stereo_options.h"

namespace riftmap {

/// riftmap-disparity: matches a rectified pair of image files and writes the disparity as PFM
/// (Middlebury's convention) with a picture beside it.
class DisparityProgram : public Program {
 public:
    DisparityProgram();
    void run() override;

 protected:
    void describe(OptionTable& table) override;
    void arguments(CommandLine& line) override;

 private:
    StereoOptions stereo_;
    std::string matcher_;  ///< --matcher; empty: that of the configuration
    std::string repeat_;   ///< --time
};

}  // namespace riftmap
