// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/info_program.h"

#include <Eigen/Geometry>
#include <cstdio>
#include <sstream>

#include "riftmap/apps/run_recorder.h"
#include "riftmap/core/file.h"
#include "riftmap/core/ply.h"
#include "riftmap/core/tum.h"
#include "riftmap/maps/graph_scene.h"
#include "riftmap/maps/map_file.h"

namespace riftmap {
namespace {

namespace fs = std::filesystem;

std::string text(const Eigen::Vector3f& v) {
    std::ostringstream out;
    out << v.x() << ' ' << v.y() << ' ' << v.z();
    return out.str();
}

void print(const YamlMap& map) {
    std::fputs(map.text().c_str(), stdout);
}

YamlMap describeMap(const PixelGraph& graph) {
    Eigen::AlignedBox3f box;
    std::size_t open = 0;
    graph.forEachVertex([&](VertexId id) {
        box.extend(graph.position(id));
        open += graph.open(id) != 0 ? 1 : 0;
    });
    YamlMap map;
    map.set("kind", "map");
    map.set("raw_points", graph.rawPointCount());
    map.set("vertices", graph.vertexCount());
    map.set("open_vertices", open);
    map.set("edges", graph.edgeCount());
    map.set("surface_area_m2", graph.surfaceArea());
    map.set("rifts", graph.rifts().size());
    map.set("bytes", graph.memoryBytes());
    if (graph.vertexCount() > 0) {
        map.set("box_min_m", text(box.min()));
        map.set("box_max_m", text(box.max()));
    }
    auto options = graph.options();
    OptionTable table;
    options.describe(table);
    for (const auto& option : table.options()) {
        map.set(option.section + "." + option.key, option.format());
    }
    return map;
}

void tellRun(const fs::path& folder) {
    const auto summary = folder / "summary.yaml";
    if (!fs::exists(summary)) {
        throw FileError(folder.string() + ": no run directory: no summary.yaml in it");
    }
    std::printf("kind: run\n%s", readFile(summary).c_str());
}

}  // namespace

InfoProgram::InfoProgram()
    : Program("riftmap-info",
              "Describes maps, rawlogs, simplemaps and run directories; exports and compares maps.",
              Config::kOptional) {}

void InfoProgram::describe(OptionTable& table) {
    input_.describe(table);
    table.section("Info", "Comparison of two maps.");
    table.add("distance", distance_, 1e-6, 100.0, "m",
              "Vertices of two maps nearer than this are the same.");
}

void InfoProgram::arguments(CommandLine& line) {
    line.positional("INPUT", ".pixelgraph, .rawlog, .simplemap, .ply, .tum, or a run directory",
                    CommandLine::Count::kMany);
    line.value("compare", 0, "MAP.pixelgraph", compare_, "the map that INPUT is compared with");
}

void InfoProgram::run() {
    const auto& inputs = positionals();
    if ((!compare_.empty() || !out().empty()) && inputs.size() != 1) {
        throw ConfigError("--compare and --out take one INPUT, " + std::to_string(inputs.size()) +
                          " given");
    }
    if (!out().empty()) {
        exportMap(inputs[0]);
    } else if (!compare_.empty()) {
        const auto a = loadMap(inputs[0]);
        const auto b = loadMap(compare_);
        const auto result = compareGraphs(a.graph(), b.graph(), distance_);
        YamlMap map;
        map.set("vertices_a", result.verticesA);
        map.set("vertices_b", result.verticesB);
        map.set("only_in_a", result.onlyInA);
        map.set("only_in_b", result.onlyInB);
        map.set("mean_distance_m", result.meanDistance);
        print(map);
    } else {
        for (const auto& input : inputs) {
            std::printf("%sfile: %s\n", &input == &inputs.front() ? "" : "\n", input.c_str());
            tell(input);
        }
    }
}

void InfoProgram::tell(const fs::path& input) {
    const auto extension = input.extension();
    if (fs::is_directory(input)) {
        tellRun(input);
    } else if (extension == ".pixelgraph") {
        print(describeMap(loadMap(input).graph()));
    } else if (extension == ".rawlog" || extension == ".simplemap") {
        tellRawlog(input);
    } else if (extension == ".ply") {
        YamlMap map;
        map.set("kind", "points");
        map.set("vertices", readPly(input).points.size());
        print(map);
    } else if (extension == ".tum") {
        YamlMap map;
        map.set("kind", "trajectory");
        map.set("poses", readTum(input).size());
        print(map);
    } else if (!fs::exists(input)) {
        throw FileError(input.string() + ": no such file");
    } else {
        throw ConfigError(input.string() +
                          ": of no kind that is known; allowed: .pixelgraph, .rawlog, .simplemap, "
                          ".ply, .tum, a run directory");
    }
}

void InfoProgram::tellRawlog(const fs::path& file) {
    const auto contents = scanRawlog(file, input_);
    YamlMap map;
    map.set("kind", "rawlog");
    map.set("objects", contents.objects);
    for (const auto& [name, count] : contents.classes) {
        map.set("objects_" + name, count);
    }
    map.set("poses", contents.poses.size());
    map.set("poses_from", contents.poses.empty() ? "none"
                          : contents.actions > 0 ? "actions"
                                                 : "poses");
    for (const auto& [label, sensor] : contents.sensors) {
        const auto& left = sensor.calibration.leftCamera;
        const std::string prefix = "stereo_" + label + "_";
        map.set(prefix + "pairs", sensor.pairs);
        map.set(prefix + "first_s", textFromNanoseconds(sensor.first_ns));
        map.set(prefix + "last_s", textFromNanoseconds(sensor.last_ns));
        map.set(prefix + "size", std::to_string(left.ncols) + "x" + std::to_string(left.nrows));
        map.set(prefix + "fx_px", left.fx());
        map.set(prefix + "baseline_m", sensor.calibration.rightCameraPose.x);
        map.set(prefix + "rectified", sensor.rectified);
        map.set(prefix + "images", sensor.external ? "external" : "embedded");
    }
    map.set("damage", contents.damage.empty() ? "none" : contents.damage);
    print(map);
    if (!contents.damage.empty()) {
        throw RawlogError(contents.damage);
    }
}

void InfoProgram::exportMap(const fs::path& file) {
    checkMayWrite(out());
    const auto map = loadMap(file);
    if (out().extension() == ".ply") {
        writePly(out(), cloudOf(map.graph()));
    } else if (out().extension() == ".3Dscene") {
        saveScene(out(), map.graph());
    } else if (out().extension() == ".pixelgraph") {
        saveMap(out(), map);
    } else {
        throw ConfigError("--out " + out().string() + ": allowed: .ply, .3Dscene, .pixelgraph");
    }
}

}  // namespace riftmap
