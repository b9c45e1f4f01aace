// SPDX-License-Identifier: BSD-3-Clause
// One exploring run and the directory that it fills.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "riftmap/apps/explore_program.h"
#include "riftmap/apps/rawlog_writer.h"
#include "riftmap/apps/run_recorder.h"
#include "riftmap/core/csv.h"
#include "riftmap/core/run_directory.h"
#include "riftmap/eval/baselines.h"
#include "riftmap/eval/coverage_tracker.h"
#include "riftmap/maps/pixel_graph_map.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {

class ExploreRun {
 public:
    ExploreRun(ExploreProgram& program, RunDirectory& directory);

    /// To the end, or to the interrupt; a collision is written down and thrown again.
    void run(const std::atomic<bool>& interrupt);

 private:
    struct StepFigures {
        ExploreStep step;
        std::vector<Coverage> coverage;
        std::size_t open = 0;
    };

    void onStep(const ExploreStep& step, const Knowledge& knowledge);
    std::unique_ptr<ViewPlanner> makePlanner();
    std::vector<RiftRow> certificate() const;
    void writeCells() const;
    YamlMap figures(const std::string& error);
    void showProgress(const ExploreStep& step, const Knowledge& knowledge) const;
    void finish(const std::string& error);
    void writeReport() const;
    void collectVertices();
    std::vector<Coverage> coverageNow();
    std::size_t headlineIndex() const;
    PixelGraph& graph() { return map_.graph(); }
    const PixelGraph& graph() const { return map_.graph(); }

    ExploreProgram& program_;
    RunDirectory& directory_;
    std::unique_ptr<SimulatedPlatform> platform_;
    PixelGraphMap map_;
    ViewBuilder builder_;
    RunRecorder recorder_;
    Eigen::AlignedBox3d target_;  ///< box of an object that stands alone; else empty
    std::unique_ptr<CoverageJudge> judge_;
    std::unique_ptr<CoverageTracker> tracker_;
    std::unique_ptr<ViewPlanner> planner_;
    std::unique_ptr<RawlogWriter> rawlog_;
    std::unique_ptr<SurfaceExplorer> explorer_;
    std::unique_ptr<CsvWriter> curve_;
    std::vector<StepFigures> history_;
    std::vector<Pose> taken_;
    std::vector<Eigen::Vector3f> cloud_;  ///< what the last view measured
    std::vector<Eigen::Vector3f> points_, normals_;
    std::vector<std::array<std::uint8_t, 3>> colours_;
};

}  // namespace riftmap
