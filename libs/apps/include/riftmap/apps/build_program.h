// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "riftmap/apps/program.h"
#include "riftmap/apps/rawlog_reader.h"
#include "riftmap/apps/run_recorder.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/paper_planner.h"
#include "riftmap/stereo/stereo_options.h"

namespace riftmap {

/// Section [Output] of riftmap-build.
struct BuildOutputOptions {
    bool pictures = true;   ///< PNG files
    bool simplemap = true;  ///< keyframes.simplemap, the views for programs of MRPT
    bool plan = true;       ///< dominant rift and the way to its view
    void describe(OptionTable& table);
};

/// riftmap-build: rawlog or simplemap -> map. What the paper does with a recording, end to end.
class BuildProgram : public Program {
 public:
    BuildProgram();
    ~BuildProgram() override;
    void run() override;

    /// A column of the table that is printed (the paper's Table I).
    struct Figures {
        std::size_t views = 0, rawPoints = 0, vertices = 0, edges = 0, rifts = 0;
        double surfaceArea = 0;  ///< [m^2]
    };
    // After run(), also where it threw with something mapped:
    std::optional<Figures> firstView, end;
    PaperPlan plan;  ///< on the final map

 protected:
    void describe(OptionTable& table) override;
    void arguments(CommandLine& line) override;

 private:
    class Run;

    RawlogOptions input_;
    StereoOptions stereo_;
    GraphOptions graph_;
    PaperPlannerOptions planner_;
    BuildOutputOptions output_;
    std::filesystem::path poses_;
};

}  // namespace riftmap
