// SPDX-License-Identifier: BSD-3-Clause
// One exploring run and the directory that it fills.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "explore_record.h"
#include "riftmap/apps/explore_program.h"
#include "riftmap/apps/rawlog_writer.h"
#include "riftmap/apps/run_recorder.h"
#include "riftmap/core/csv.h"
#include "riftmap/core/run_directory.h"
#include "riftmap/eval/baselines.h"
#include "riftmap/eval/coverage_tracker.h"
#include "riftmap/maps/pixel_graph_map.h"
#include "riftmap/planner/forecast.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {

class ExploreRun {
 public:
    /// `resumed`: the directory is that of an interrupted run. Its views are taken from there, with
    /// the figures and times measured then.
    ExploreRun(ExploreProgram& program, RunDirectory& directory, bool resumed);

    /// To the end, or to the interrupt; a collision is written down and thrown again. Who is
    /// interrupted before there is a new view leaves the directory as it was.
    void run(const std::atomic<bool>& interrupt);

 private:
    struct StepFigures {
        ExploreStep step;
        std::vector<Coverage> coverage;
        std::size_t open = 0;
    };

    void makeJudge();
    void record(StereoObservation& observation);
    std::vector<Coverage> coverageAfter(const ExploreStep& step);
    void onStep(const ExploreStep& step, const Knowledge& knowledge);
    std::unique_ptr<ViewPlanner> makePlanner();
    std::vector<RiftRow> certificate() const;
    void writeCells() const;
    YamlMap figures(const std::string& error);
    std::optional<Forecast> forecastNow(double leastGain) const;
    void showProgress(const StepRow& row, const ExploreStep& step,
                      const std::optional<Forecast>& ahead) const;
    void takeOver();
    void finish(const std::string& error);
    void writeReport() const;
    void writePictureOfView(std::size_t number);
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
    bool resumed_;
    std::string config_;    ///< as given, before a cache is chosen
    ExploreRecord record_;  ///< of the run that this one goes on with; else empty
    std::unique_ptr<RunRecorder> recorder_;
    std::unique_ptr<ReplayingPlatform> replay_;
    Eigen::AlignedBox3d target_;  ///< box of an object that stands alone; else empty
    std::unique_ptr<CoverageJudge> judge_;
    std::unique_ptr<CoverageTracker> tracker_;
    std::unique_ptr<ViewPlanner> planner_;
    std::unique_ptr<RawlogWriter> rawlog_;
    std::unique_ptr<SurfaceExplorer> explorer_;
    std::unique_ptr<CsvWriter> curve_;
    std::unique_ptr<CsvWriter> gains_;  ///< what was expected of each view and what came true
    std::vector<StepFigures> history_;
    std::vector<Pose> taken_;
    std::vector<Eigen::Vector3f> cloud_;  ///< what the last view measured
    std::vector<Eigen::Vector3f> points_, normals_;
    std::vector<std::array<std::uint8_t, 3>> colours_;
};

}  // namespace riftmap
