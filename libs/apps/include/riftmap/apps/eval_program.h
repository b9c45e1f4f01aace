// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "riftmap/apps/program.h"
#include "riftmap/apps/rawlog_reader.h"
#include "riftmap/eval/coverage.h"
#include "riftmap/eval/octomap_check.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/sim/simulated_platform.h"
#include "riftmap/sim/trajectory.h"
#include "riftmap/stereo/stereo_options.h"

namespace riftmap {

/// Section [Judge]: what riftmap-eval does besides the figures.
struct JudgeOptions {
    double octomapResolution = 0;  ///< of the cross-check [m]; 0 = the headline distance
    bool pictures = true;          ///< PNG of coverage and error
    void describe(OptionTable& table);
};

/// riftmap-eval: how complete and how accurate a map is, by doc/coverage_protocol.md.
class EvalProgram : public Program {
 public:
    EvalProgram();
    ~EvalProgram() override;
    void run() override;

    // After run():
    CoverageReport report;
    std::optional<OctomapComparison> octomap;  ///< where a rawlog was given
    double meshArea = 0;                       ///< [m^2]
    std::optional<double> mapArea;             ///< [m^2], where the map says it

 protected:
    void describe(OptionTable& table) override;
    void arguments(CommandLine& line) override;

 private:
    struct Map;
    /// Places of a certificate [m].
    struct Certificate {
        std::vector<Eigen::Vector3f> open;      ///< all tears that are not resolved
        std::vector<Eigen::Vector3f> verdicts;  ///< those called unreachable or unobservable
    };

    Map readMap() const;
    static Certificate readRifts(const std::filesystem::path& file);
    OctomapCheck check(const Map& map, const TrueSurface& truth, double headline);
    void write(const Map& map, const CoverageJudge& judge, const SimulatedPlatform& platform,
               const RunDirectory& directory, const VoxelOwners& owners);
    void print() const;

    SimulationOptions simulation_;
    // Not used, but the files of riftmap-simulate and riftmap-build hold them.
    TrajectoryOptions trajectory_;
    GraphOptions graph_;
    EvalOptions eval_;
    JudgeOptions judge_;
    RawlogOptions input_;
    StereoOptions stereo_;
    std::filesystem::path map_, rifts_, rawlog_;
    std::string world_;
};

}  // namespace riftmap
