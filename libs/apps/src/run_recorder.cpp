// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/run_recorder.h"

#include <algorithm>
#include <cmath>

#include "riftmap/core/file.h"
#include "riftmap/core/ply.h"
#include "riftmap/core/tum.h"
#include "riftmap/maps/map_file.h"

namespace riftmap {
namespace {

std::vector<std::string> stepColumns(bool withCoverage) {
    std::vector<std::string> columns = {"view",     "time",  "raw_points",
                                        "vertices", "edges", "surface_area_m2"};
    for (const auto* state : kRiftStateNames) {
        columns.push_back(std::string("rifts_") + state);
    }
    for (const auto* column : {"path_length_m", "stereo_ms", "merge_ms", "rifts_ms", "plan_ms"}) {
        columns.emplace_back(column);
    }
    if (withCoverage) {
        columns.emplace_back("coverage");
    }
    columns.emplace_back("seconds");
    return columns;
}

/// The value that a share `q` of the values does not exceed; 0 of none.
double quantile(std::vector<double> values, double q) {
    if (values.empty()) {
        return 0;
    }
    const auto last = static_cast<double>(values.size() - 1);
    const auto at = values.begin() + std::lround(q * last);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

/// Empty where nothing is known.
template <class T>
Field fieldOf(const std::optional<T>& value) {
    return value ? Field(*value) : Field("");
}

/// "3 17 20"
Field idsOf(const std::vector<std::uint64_t>& ids) {
    std::string text;
    for (const std::uint64_t id : ids) {
        text += (text.empty() ? "" : " ") + std::to_string(id);
    }
    return text;
}

}  // namespace

std::string kindNames(std::uint8_t kinds) {
    std::string names;
    for (const auto& [bit, name] :
         {std::pair{kDepthStep, "depth_step"}, std::pair{kImageBorder, "image_border"},
          std::pair{kNoMatch, "no_match"}, std::pair{kTooCoarse, "too_coarse"}}) {
        if ((kinds & bit) != 0) {
            names += (names.empty() ? "" : "+") + std::string(name);
        }
    }
    return names.empty() ? "closed" : names;
}

RunRecorder::RunRecorder(const RunDirectory& run, bool withCoverage, CsvWriter::Mode mode,
                         double secondsBefore)
    : run_(run),
      withCoverage_(withCoverage),
      secondsBefore_(secondsBefore),
      steps_(run.file("steps.csv"), stepColumns(withCoverage), mode),
      trajectory_(run.file("trajectory.tum"),
                  mode == CsvWriter::Mode::kAppend ? std::ios::app : std::ios::trunc) {
    if (!trajectory_) {
        throw FileError(run.file("trajectory.tum").string() + ": cannot be written");
    }
}

void RunRecorder::step(const PixelGraph& graph, const StepRow& row) {
    std::vector<Field> fields = {rows_.size(),          textFromNanoseconds(row.time_ns),
                                 graph.rawPointCount(), graph.vertexCount(),
                                 graph.edgeCount(),     graph.surfaceArea()};
    fields.insert(fields.end(), row.rifts.begin(), row.rifts.end());
    fields.insert(fields.end(),
                  {row.pathLength, row.stereoMs, row.mergeMs, row.riftsMs, row.planMs});
    if (withCoverage_) {
        fields.push_back(fieldOf(row.coverage));
    }
    fields.emplace_back(row.seconds);
    steps_.row(fields);
    trajectory_ << tumLine({row.time_ns, row.world_T_camera}) << '\n' << std::flush;
    if (!trajectory_) {
        throw FileError(run_.file("trajectory.tum").string() + ": cannot be written");
    }
    rows_.push_back(row);
}

double RunRecorder::seconds() const {
    const std::chrono::duration<double> now = std::chrono::steady_clock::now() - start_;
    return secondsBefore_ + now.count();
}

void RunRecorder::finish(const PixelGraphMap& map, const std::vector<RiftRow>& rifts,
                         const SceneExtras& scene, const std::string& stopReason,
                         const YamlMap& more) {
    writePly(run_.file("graph.ply"), cloudOf(map.graph()), {"frame map", "unit metre"});
    saveMap(run_.file("map.pixelgraph"), map);
    saveScene(run_.file("scene.3Dscene"), map.graph(), scene);

    writeRifts(rifts);
    writeSummary(map.graph(), rifts, stopReason, more);
}

void RunRecorder::writeRifts(const std::vector<RiftRow>& rifts) const {
    CsvWriter table(
        run_.file("rifts.csv"),
        {"id",    "state",     "reason", "type",          "x",         "y",        "z",
         "nx",    "ny",        "nz",     "open_vertices", "edges",     "attempts", "extent_m",
         "rim_m", "coarse_m2", "cells",  "first_view",    "last_view", "parents",  "joined"});
    for (const auto& r : rifts) {
        table.row({r.id,
                   r.state,
                   r.reason,
                   r.type,
                   r.centre.x(),
                   r.centre.y(),
                   r.centre.z(),
                   r.normal.x(),
                   r.normal.y(),
                   r.normal.z(),
                   r.openVertices,
                   r.edges,
                   r.attempts,
                   fieldOf(r.extent),
                   fieldOf(r.rim),
                   fieldOf(r.coarse),
                   fieldOf(r.cells),
                   r.firstView,
                   r.lastView,
                   idsOf(r.parents),
                   idsOf(r.joined)});
    }
}

void RunRecorder::writeSummary(const PixelGraph& graph, const std::vector<RiftRow>& rifts,
                               const std::string& stopReason, const YamlMap& more) const {
    YamlMap summary;
    summary.set("views", rows_.size());
    summary.set("raw_points", graph.rawPointCount());
    summary.set("vertices", graph.vertexCount());
    summary.set("edges", graph.edgeCount());
    summary.set("surface_area_m2", graph.surfaceArea());
    for (const std::string state : kRiftStateNames) {
        summary.set("rifts_" + state,
                    std::count_if(rifts.begin(), rifts.end(),
                                  [&](const RiftRow& r) { return r.state == state; }));
    }
    summary.set("path_length_m", rows_.empty() ? 0.0 : rows_.back().pathLength);
    summary.set("stop_reason", stopReason);
    summary.set("wall_s", seconds());
    for (const auto& [name, member] :
         {std::pair{"stereo_ms", &StepRow::stereoMs}, std::pair{"merge_ms", &StepRow::mergeMs},
          std::pair{"rifts_ms", &StepRow::riftsMs}, std::pair{"plan_ms", &StepRow::planMs}}) {
        std::vector<double> values;
        for (const auto& row : rows_) {
            values.push_back(row.*member);
        }
        summary.set(std::string(name) + "_median", quantile(values, 0.5));
        summary.set(std::string(name) + "_p95", quantile(values, 0.95));
    }
    summary.set("peak_rss_mb", peakRssMb());
    summary.set("bytes_per_vertex", graph.vertexCount() == 0
                                        ? 0.0
                                        : static_cast<double>(graph.memoryBytes()) /
                                              static_cast<double>(graph.vertexCount()));
    for (const auto& [key, value] : more.entries()) {
        summary.set(key, value);
    }
    run_.writeSummary(summary);
}

}  // namespace riftmap
