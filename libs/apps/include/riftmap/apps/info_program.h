// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "riftmap/apps/program.h"
#include "riftmap/apps/rawlog_reader.h"

namespace riftmap {

/// riftmap-info: says what a saved map, rawlog, simplemap or run directory holds; exports and
/// compares saved maps. The answer on stdout is `key: value`, a line each, a block an input.
class InfoProgram : public Program {
 public:
    InfoProgram();
    void run() override;

 protected:
    void describe(OptionTable& table) override;
    void arguments(CommandLine& line) override;

 private:
    void tell(const std::filesystem::path& input);
    void tellRawlog(const std::filesystem::path& file);
    void exportMap(const std::filesystem::path& file);

    RawlogOptions input_;
    double distance_ = 0.02;  ///< [m]
    std::filesystem::path compare_;
};

}  // namespace riftmap
