// SPDX-License-Identifier: BSD-3-Clause
// What an interrupted exploring run has left behind, for the run that goes on with it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "riftmap/apps/rawlog_reader.h"
#include "riftmap/apps/run_recorder.h"
#include "riftmap/core/platform.h"
#include "riftmap/core/run_directory.h"
#include "riftmap/eval/coverage_tracker.h"
#include "riftmap/sim/simulated_platform.h"

namespace riftmap {

/// Throws ConfigError where the configuration there (`config_used.ini`) differs from this one in
/// anything that decides what a view shows or which comes next.
void checkSameConfiguration(const RunDirectory& directory, const std::string& config);

/// Why the run there ended, if it went to its own end under this configuration: "complete", or a
/// limit that has not been changed since.
std::optional<std::string> howItEnded(const RunDirectory& directory, const std::string& config);

/// Its views: what was seen, and what was measured after.
struct ExploreRecord {
    std::size_t observations = 0;  ///< in run.rawlog
    std::vector<StepRow> rows;     ///< times and coverage alone; not more than observations
    std::vector<std::vector<Coverage>> coverage;  ///< of each row; empty without a judge
    double seconds() const { return rows.empty() ? 0.0 : rows.back().seconds; }
    std::size_t views() const { return std::max(rows.size(), observations); }
};

/// Reads it, and cuts the files of the directory behind the last view that is whole in all of them:
/// whoever was killed may have left half a line or half an object. `deltas` of the judge, empty
/// without one. Throws FileError.
ExploreRecord salvageRecord(const RunDirectory& directory, bool rawlog,
                            const std::vector<double>& deltas);

/// The simulated platform, but the views of a record are read from its rawlog instead of rendered,
/// each checked to be from where the camera is. Not thread-safe.
class ReplayingPlatform : public CameraPlatform {
 public:
    /// @param views so many of the rawlog are taken. Throws RawlogError.
    ReplayingPlatform(SimulatedPlatform& platform, const RunDirectory& directory,
                      std::size_t views);

    StereoCamera camera() const override { return platform_.camera(); }
    PlatformLimits limits() const override { return platform_.limits(); }
    Pose pose() const override { return platform_.pose(); }
    void moveAlong(const std::vector<Pose>& path) override { platform_.moveAlong(path); }
    /// Throws std::runtime_error where the recorded view is from elsewhere.
    StereoObservation grab() override;
    /// True if the last view came from the record.
    bool replayed() const { return grabbed_ <= views_; }
    /// True as long as the next one will.
    bool replays() const { return grabbed_ < views_; }

 private:
    SimulatedPlatform& platform_;
    std::optional<RawlogReader> reader_;
    std::string rawlog_;
    std::size_t views_ = 0, grabbed_ = 0;
};

}  // namespace riftmap
