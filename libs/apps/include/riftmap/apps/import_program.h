// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "riftmap/apps/importers.h"
#include "riftmap/apps/program.h"

namespace riftmap {

/// riftmap-import: a public data set -> rawlog.
class ImportProgram : public Program {
 public:
    ImportProgram();
    void run() override;

    ImportReport report;  ///< after run()

 protected:
    void describe(OptionTable& table) override;
    void arguments(CommandLine& line) override;

 private:
    KittiOptions kitti_;
    PairOptions pair_;
    std::filesystem::path calibration_;
    bool external_ = false;
};

}  // namespace riftmap
