// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/eval_program.h"

#include <cmath>
#include <cstdio>

#include "riftmap/core/csv.h"
#include "riftmap/core/file.h"
#include "riftmap/core/ply.h"
#include "riftmap/core/progress.h"
#include "riftmap/core/run_directory.h"
#include "riftmap/eval/pictures.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/maps/map_file.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {
namespace {

namespace fs = std::filesystem;

/// "2mm", "5cm": as keys of the summary end.
std::string deltaName(double delta) {
    const double cm = delta * 100;
    char text[32];
    if (cm > 0.999 && std::abs(cm - std::round(cm)) < 1e-6) {
        std::snprintf(text, sizeof text, "%.0fcm", cm);
    } else {
        std::snprintf(text, sizeof text, "%gmm", delta * 1000);
    }
    return text;
}

/// The value of a key of a flat YAML file; nothing if it is not there.
std::optional<double> yamlNumber(const fs::path& file, const std::string& key) {
    if (!fs::exists(file)) {
        return std::nullopt;
    }
    const std::string text = "\n" + readFile(file);
    const auto at = text.find("\n" + key + ": ");
    if (at == std::string::npos) {
        return std::nullopt;
    }
    return std::strtod(text.c_str() + at + key.size() + 3, nullptr);
}

void setWorld(const std::string& given, WorldOptions& world) {
    for (const auto& [name, value] : {std::pair{"room", WorldOptions::Name::kRoom},
                                      {"rooms", WorldOptions::Name::kRooms},
                                      {"courtyard", WorldOptions::Name::kCourtyard},
                                      {"sculpture", WorldOptions::Name::kSculpture},
                                      {"plane", WorldOptions::Name::kPlane},
                                      {"steps", WorldOptions::Name::kSteps}}) {
        if (given == name) {
            world.name = value;
            world.mesh.clear();
            return;
        }
    }
    world.mesh = given;
}

YamlMap summaryOf(const CoverageReport& report) {
    YamlMap out;
    out.set("samples", report.samples);
    out.set("samples_observable", report.observable);
    out.set("vertices", report.vertices);
    out.set("headline_m", report.headline);
    for (const DistanceFigures& f : report.at) {
        const std::string at = "_" + deltaName(f.delta);
        out.set("c_obs" + at, f.cObs);
        out.set("c_all" + at, f.cAll);
        out.set("c_obs_strict" + at, f.cObsStrict);
        out.set("c_all_strict" + at, f.cAllStrict);
        out.set("accuracy" + at, f.accuracy);
        out.set("f_score" + at, f.fScore);
        out.set("spurious" + at, f.spurious);
    }
    out.set("error_median_m", report.errorMedian);
    out.set("error_p95_m", report.errorP95);
    out.set("error_mean_m", report.errorMean);
    out.set("explained", report.explained);
    out.set("certificate_right", report.certificateRight);
    out.set("certificate_verdicts", report.verdicts);
    return out;
}

void addOctomap(const OctomapComparison& c, YamlMap& out) {
    out.set("octomap_resolution_m", c.resolution);
    out.set("octomap_views", c.views);
    out.set("octomap_occupied_voxels", c.occupied);
    out.set("octomap_our_voxels", c.ours);
    out.set("octomap_surface_voxels", c.surfaceVoxels);
    out.set("octomap_coverage", c.octomapCoverage());
    out.set("octomap_our_coverage", c.ourCoverage());
    out.set("octomap_our_coverage_by_vertices", c.vertexCoverage());
    out.set("octomap_coverage_within_a_voxel", c.octomapCoverageNear());
    out.set("octomap_our_coverage_within_a_voxel", c.ourCoverageNear());
    out.set("octomap_only_occupied_clipped", c.onlyOccupiedClipped);
    out.set("octomap_only_occupied_beside_ours", c.onlyOccupiedBeside);
    out.set("octomap_only_occupied_missed", c.onlyOccupiedMissed);
    out.set("octomap_only_ours_carved_free", c.onlyOursFree);
    out.set("octomap_only_ours_unknown", c.onlyOursUnknown);
    out.set("octomap_occupied_off_the_surface", c.occupiedOffSurface);
    out.set("octomap_occupied_far_off_the_surface", c.occupiedFarOff);
    out.set("octomap_ours_off_the_surface", c.oursOffSurface);
    out.set("octomap_ours_far_off_the_surface", c.oursFarOff);
    out.set("octomap_occupied_not_ours", c.occupiedNotOurs);
    out.set("octomap_occupied_far_from_ours", c.occupiedFarFromOurs);
    out.set("octomap_vertices_in_free", c.verticesInFree);
    out.set("octomap_vertices_far_in_free", c.verticesFarInFree);
    out.set("octomap_vertices_in_unknown", c.verticesInUnknown);
}

/// The ground truth as it was used: green covered, red observable but not covered, grey neither.
void writeSamples(const fs::path& file, const CoverageJudge& judge,
                  const std::vector<float>& distances) {
    PointCloud cloud;
    cloud.points = judge.samples().points;
    cloud.normals = judge.observable().normals;
    for (std::size_t i = 0; i < distances.size(); ++i) {
        const bool covered = distances[i] <= static_cast<float>(judge.headline());
        const bool observable = judge.observable().observable[i] != 0;
        cloud.colours.push_back(covered      ? std::array<std::uint8_t, 3>{85, 170, 95}
                                : observable ? std::array<std::uint8_t, 3>{225, 45, 40}
                                             : std::array<std::uint8_t, 3>{150, 165, 190});
    }
    char hash[64];
    std::snprintf(hash, sizeof hash, "mesh %016llx seed %llu",
                  static_cast<unsigned long long>(judge.samples().meshHash),
                  static_cast<unsigned long long>(judge.samples().seed));
    writePly(file, cloud, {hash});
}

TrueSurface observableSurface(const CoverageJudge& judge) {
    TrueSurface out;
    for (std::size_t i = 0; i < judge.samples().points.size(); ++i) {
        if (judge.observable().observable[i] != 0) {
            out.points.push_back(judge.samples().points[i]);
            out.normals.push_back(judge.samples().normals[i]);
        }
    }
    return out;
}

}  // namespace

/// What is judged.
struct EvalProgram::Map {
    std::vector<Eigen::Vector3f> points, normals;       ///< normals may be empty
    MapSurface surface;                                 ///< for the cross-check; else empty
    std::optional<double> area;                         ///< [m^2]
    std::optional<std::vector<Eigen::Vector3f>> rifts;  ///< the certificate's places
    std::vector<Eigen::Vector3f> verdicts;              ///< tears that it says no camera can close
};

void JudgeOptions::describe(OptionTable& table) {
    table.section("Judge", "What riftmap-eval does besides the figures of [Eval].");
    table.add("octomap_resolution", octomapResolution, 0.0, 10.0, "m",
              "Of the cross-check with OctoMap (needs --rawlog); 0: the headline distance.");
    table.add("pictures", pictures, "PNG pictures of coverage and error.");
}

EvalProgram::EvalProgram()
    : Program("riftmap-eval",
              "Judges a map against the world it is of: coverage, accuracy, OctoMap cross-check.",
              Config::kOptional) {}
EvalProgram::~EvalProgram() = default;

void EvalProgram::describe(OptionTable& table) {
    simulation_.describe(table);
    trajectory_.describe(table);
    eval_.describe(table);
    judge_.describe(table);
    input_.describe(table);
    stereo_.describe(table);
    graph_.describe(table);
}

void EvalProgram::arguments(CommandLine& line) {
    line.value("map", 0, "FILE", map_, "the map: any .ply with vertices, or a .pixelgraph");
    line.value("world", 0, "NAME|FILE", world_,
               "built-in world or mesh file, in place of World.name and World.mesh");
    line.value("rifts", 0, "FILE", rifts_,
               "certificate; without it rift_cells.csv or else rifts.csv beside the map");
    line.value("rawlog", 0, "FILE", rawlog_,
               "the observations the map was made of, for the cross-check with OctoMap");
}

EvalProgram::Map EvalProgram::readMap() const {
    Map out;
    const auto takeGraph = [&](const PixelGraph& graph) {
        out.area = graph.surfaceArea();
        if (!rawlog_.empty()) {
            out.surface = surfaceOf(graph);
        }
        out.rifts = rimsOf(graph);
    };
    if (map_.extension() == ".pixelgraph") {
        const PixelGraphMap map = loadMap(map_);
        PointCloud cloud = cloudOf(map.graph());
        out.points = std::move(cloud.points);
        out.normals = std::move(cloud.normals);
        takeGraph(map.graph());
    } else {
        PointCloud cloud = readPly(map_);
        out.points = std::move(cloud.points);
        out.normals = std::move(cloud.normals);
        // Beside a graph.ply of ours lies the graph itself, with its area and its rifts.
        const fs::path graph = map_.parent_path() / "map.pixelgraph";
        if (map_.filename() == "graph.ply" && fs::exists(graph)) {
            takeGraph(loadMap(graph).graph());
        } else {
            out.area = yamlNumber(map_.parent_path() / "summary.yaml", "surface_area_m2");
        }
    }
    if (out.points.empty()) {
        throw FileError(map_.string() + ": no vertices in it");
    }
    if (out.surface.vertices.empty()) {
        out.surface.vertices = out.points;
    }
    fs::path table = rifts_;
    for (const char* beside : {"rift_cells.csv", "rifts.csv"}) {
        if (table.empty() && fs::exists(map_.parent_path() / beside)) {
            table = map_.parent_path() / beside;
        }
    }
    if (!table.empty()) {
        Certificate certificate = readRifts(table);
        if (!rifts_.empty() || !out.rifts) {
            out.rifts = std::move(certificate.open);
        }
        out.verdicts = std::move(certificate.verdicts);
    }
    return out;
}

EvalProgram::Certificate EvalProgram::readRifts(const fs::path& file) {
    const CsvTable table = readCsv(file);
    Certificate out;
    try {
        const std::size_t state = table.column("state");
        const std::size_t x = table.column("x");
        const std::size_t y = table.column("y");
        const std::size_t z = table.column("z");
        for (const auto& row : table.rows) {
            const Eigen::Vector3f place(std::stof(row[x]), std::stof(row[y]), std::stof(row[z]));
            if (row[state] != "resolved") {
                out.open.push_back(place);
            }
            if (row[state] == "unreachable" || row[state] == "unobservable") {
                out.verdicts.push_back(place);
            }
        }
    } catch (const std::logic_error& e) {
        throw FileError(file.string() + ": not a table of rifts: " + e.what());
    }
    return out;
}

void EvalProgram::run() {
    if (map_.empty()) {
        throw ConfigError("--map is missing: the .ply or .pixelgraph to judge");
    }
    if (!world_.empty()) {
        setWorld(world_, simulation_.world);
    }
    const Map map = readMap();
    const SimulatedPlatform platform(simulation_, seed());
    std::vector<fs::path> inputs{map_};
    if (!simulation_.world.mesh.empty()) {
        inputs.emplace_back(simulation_.world.mesh);
    }
    const RunDirectory directory = makeRunDirectory(inputs);
    eval_.resolveCache();
    const CoverageJudge judge(
        platform.world().mesh, platform.rayCaster(),
        viewSpaceOf(platform.limits(), platform.camera(), platform.pose().translation), eval_,
        progressOf("what can be seen:", "looks"));
    meshArea = judge.meshArea();
    mapArea = map.area;
    report =
        judge.evaluate(map.points, map.normals, map.rifts ? &*map.rifts : nullptr, map.verdicts);
    VoxelOwners owners;
    std::optional<OctomapCheck> voxels;
    if (!rawlog_.empty()) {
        const TrueSurface truth = observableSurface(judge);
        voxels = check(map, truth, judge.headline());
        owners = voxels->owners(map.surface, truth);
    }
    write(map, judge, platform, directory, owners);
    print();
}

OctomapCheck EvalProgram::check(const Map& map, const TrueSurface& truth, double headline) {
    // Off the places where walls of worlds made by hand lie: by no simple part of a voxel.
    const Eigen::Vector3f shift(0.37F, 0.41F, 0.43F);
    OctomapCheck check(judge_.octomapResolution > 0 ? judge_.octomapResolution : headline, shift);
    RawlogReader reader(rawlog_, input_);
    ViewBuilder builder(stereo_);
    Progress bar("into OctoMap", "views", reader.expectedViews(), progress());
    std::size_t done = 0;
    while (const auto observation = reader.next()) {
        check.insert(builder.build(*observation));
        bar.update(++done);
    }
    octomap = check.compare(map.surface, truth);
    return check;
}

void EvalProgram::write(const Map& map, const CoverageJudge& judge,
                        const SimulatedPlatform& platform, const RunDirectory& directory,
                        const VoxelOwners& owners) {
    YamlMap summary;
    summary.set("world", platform.world().name);
    char hash[32];
    std::snprintf(hash, sizeof hash, "%016llx",
                  static_cast<unsigned long long>(judge.samples().meshHash));
    summary.set("mesh_hash", hash);
    summary.set("sample_seed", judge.samples().seed);
    const YamlMap figures = summaryOf(report);
    for (const auto& [key, value] : figures.entries()) {
        summary.set(key, value);
    }
    summary.set("world_area_m2", meshArea);
    summary.set("observable_area_m2", meshArea * static_cast<double>(report.observable) /
                                          static_cast<double>(report.samples));
    if (mapArea) {
        summary.set("map_area_m2", *mapArea);
    }
    if (octomap) {
        addOctomap(*octomap, summary);
    }
    directory.writeSummary(summary);

    CsvWriter table(directory.file("coverage.csv"),
                    {"delta_m", "c_obs", "c_all", "c_obs_strict", "c_all_strict", "accuracy",
                     "f_score", "spurious"});
    for (const DistanceFigures& f : report.at) {
        table.row({f.delta, f.cObs, f.cAll, f.cObsStrict, f.cAllStrict, f.accuracy, f.fScore,
                   f.spurious});
    }
    writeSamples(directory.file("samples.ply"), judge, judge.sampleDistances(map.points));
    if (judge_.pictures) {
        const CoveragePictures pictures(judge, platform.world().mesh, platform.rayCaster(),
                                        map.points, map.normals);
        pictures.write(directory.path(), judge.vertexErrors(map.points));
        if (owners) {
            pictures.writeOwners(directory.path(), owners);
        }
    }
}

void EvalProgram::print() const {
    std::printf(
        "%zu of %zu samples observable (%.2f of %.2f m^2), %zu vertices", report.observable,
        report.samples,
        meshArea * static_cast<double>(report.observable) / static_cast<double>(report.samples),
        meshArea, report.vertices);
    if (mapArea) {
        std::printf(", area of the map %.2f m^2", *mapArea);
    }
    std::printf("\n%8s %9s %9s %9s %9s %9s %9s\n", "within", "C_obs", "C_all", "strict", "accuracy",
                "F", "spurious");
    for (const DistanceFigures& f : report.at) {
        std::printf("%8s %8.2f%% %8.2f%% %8.2f%% %8.2f%% %8.2f%% %8.2f%%\n",
                    deltaName(f.delta).c_str(), 100 * f.cObs, 100 * f.cAll, 100 * f.cObsStrict,
                    100 * f.accuracy, 100 * f.fScore, 100 * f.spurious);
    }
    std::printf("error of the vertices: median %.2f mm, 95 %% below %.2f mm\n",
                1000 * report.errorMedian, 1000 * report.errorP95);
    if (!std::isnan(report.explained)) {
        std::printf("uncovered and explained by a rift: %.2f%%\n", 100 * report.explained);
    }
    if (report.verdicts > 0) {
        std::printf("tears called unreachable or unobservable: %zu, rightly %.2f%%\n",
                    report.verdicts, 100 * report.certificateRight);
    }
    if (octomap) {
        const OctomapComparison& c = *octomap;
        const auto part = [&](std::size_t n) {
            return 100.0 * static_cast<double>(n) / static_cast<double>(c.surfaceVoxels);
        };
        std::printf(
            "OctoMap at %s, %zu views, %zu surface voxels: occupied %.2f%%, our surface in it "
            "%.2f%% (a vertex of ours %.2f%%; within a voxel: %.2f%%, %.2f%%)\n"
            "  only OctoMap's: clipped by the surface %.2f%%, ours beside it %.2f%%, missed by us "
            "%.2f%%; only ours: carved free by later rays %.2f%%, unknown to it %.2f%%\n"
            "  off the surface (and not beside it): %zu (%zu) of %zu occupied voxels, %zu (%zu) of "
            "%zu of ours; vertices in free voxels %zu of %zu (nothing occupied beside them: %zu)\n",
            deltaName(c.resolution).c_str(), c.views, c.surfaceVoxels, 100 * c.octomapCoverage(),
            100 * c.ourCoverage(), 100 * c.vertexCoverage(), 100 * c.octomapCoverageNear(),
            100 * c.ourCoverageNear(), part(c.onlyOccupiedClipped), part(c.onlyOccupiedBeside),
            part(c.onlyOccupiedMissed), part(c.onlyOursFree), part(c.onlyOursUnknown),
            c.occupiedOffSurface, c.occupiedFarOff, c.occupied, c.oursOffSurface, c.oursFarOff,
            c.ours, c.verticesInFree, c.vertices, c.verticesFarInFree);
    }
}

}  // namespace riftmap
