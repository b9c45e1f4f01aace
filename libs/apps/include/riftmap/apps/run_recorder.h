// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "riftmap/core/csv.h"
#include "riftmap/core/pose.h"
#include "riftmap/core/run_directory.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/maps/graph_scene.h"
#include "riftmap/maps/pixel_graph_map.h"

namespace riftmap {

/// The states a rift can end in, in the order of the columns.
inline constexpr std::array<const char*, 6> kRiftStateNames = {
    "open", "deferred", "unreachable", "unobservable", "below_resolution", "resolved"};
/// How many rifts are in each.
using RiftCounts = std::array<std::size_t, kRiftStateNames.size()>;

/// "depth_step+image_border" for a set of OpenKind bits; "closed" for none.
std::string kindNames(std::uint8_t kinds);

/// A row of steps.csv: one view.
struct StepRow {
    std::int64_t time_ns = 0;  ///< since the Unix epoch [ns]
    Pose world_T_camera;       ///< left optical frame in the map frame
    RiftCounts rifts = {};
    double pathLength = 0;  ///< so far [m]
    double stereoMs = 0, mergeMs = 0, riftsMs = 0, planMs = 0;
    std::optional<double> coverage;  ///< 0 .. 1, where truth is known
    double seconds = 0;              ///< since the run began
};

/// A row of rifts.csv, the certificate: what became of one connected tear. Map frame.
struct RiftRow {
    std::uint64_t id = 0;                              ///< follows it from view to view
    std::string state;                                 ///< of kRiftStateNames
    std::string reason;                                ///< one sentence, may be empty
    std::string type;                                  ///< kindNames()
    Eigen::Vector3f centre = Eigen::Vector3f::Zero();  ///< [m]
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    std::size_t openVertices = 0, edges = 0;
    std::size_t attempts = 0;  ///< views taken to close it
    /// Longest side of the box around its cells [m], length of what is torn [m], area that is too
    /// coarse [m^2], cells of the planner's summary; nothing where there was no planner.
    std::optional<double> extent, rim, coarse;
    std::optional<std::size_t> cells;
    std::size_t firstView = 0, lastView = 0;     ///< that had it, from 0
    std::vector<std::uint64_t> parents, joined;  ///< ids that it split off, that became part of it
};

/// Writes what a mapping run leaves behind into its run directory (doc/file_formats.md): steps.csv
/// and trajectory.tum grow with each view, so that a run that is killed still has them; the rest
/// is written by finish(). Not thread-safe.
class RunRecorder {
 public:
    /// `withCoverage`: steps.csv has a column `coverage`. With kAppend the files go on behind what
    /// an interrupted run, `secondsBefore` long, has left in them. Throws FileError.
    RunRecorder(const RunDirectory& run, bool withCoverage,
                CsvWriter::Mode mode = CsvWriter::Mode::kNew, double secondsBefore = 0);

    /// After a view was merged. Throws FileError.
    void step(const PixelGraph& graph, const StepRow& row);
    /// A view whose row is there already.
    void stepAgain(const StepRow& row) { rows_.push_back(row); }
    double seconds() const;  ///< since the run began [s]

    /// Writes graph.ply, map.pixelgraph, scene.3Dscene, rifts.csv and summary.yaml. `more` goes to
    /// the end of the summary. Throws FileError.
    void finish(const PixelGraphMap& map, const std::vector<RiftRow>& rifts,
                const SceneExtras& scene, const std::string& stopReason, const YamlMap& more = {});

    std::size_t views() const { return rows_.size(); }
    const std::vector<StepRow>& rows() const { return rows_; }

 private:
    void writeRifts(const std::vector<RiftRow>& rifts) const;
    void writeSummary(const PixelGraph& graph, const std::vector<RiftRow>& rifts,
                      const std::string& stopReason, const YamlMap& more) const;

    RunDirectory run_;
    bool withCoverage_;
    double secondsBefore_;
    CsvWriter steps_;
    std::ofstream trajectory_;
    std::vector<StepRow> rows_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace riftmap
