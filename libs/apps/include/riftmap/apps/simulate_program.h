// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>

#include "riftmap/apps/program.h"
#include "riftmap/apps/simulated_views.h"

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
    void writeRawlog(const SimulatedViews& recording);
    /// NAME + suffix beside --out NAME.rawlog.
    std::filesystem::path beside(const char* suffix) const;

    SimulatedViewsOptions options_;
    bool external_ = true;
    bool truthImages_ = false;
};

}  // namespace riftmap
