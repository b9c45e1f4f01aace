// SPDX-License-Identifier: BSD-3-Clause
// Time and memory of the pixel graph, and of OctoMap on the same points.
//   bench-graph [--csv FILE] [--vertices N] [--quick] [--recordings]
#include <malloc.h>
#include <octomap/octomap.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "astar_comparison.h"
#include "recorded_memory.h"
#include "riftmap/graph/pixel_graph.h"
#include "synthetic_views.h"

namespace {

using riftmap::GraphOptions;
using riftmap::MergeTimes;
using riftmap::PixelGraph;
using riftmap::Pose;
using riftmap::residentBytes;
using riftmap::VertexId;
using riftmap::View;
namespace synthetic = riftmap::synthetic;

class Stopwatch {
 public:
    double ms() const {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_)
            .count();
    }

 private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Processor time of all threads: what wall time would be worth on an idle machine.
double cpuMs() {
    return static_cast<double>(std::clock()) / CLOCKS_PER_SEC * 1e3;
}

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v.empty() ? std::numeric_limits<double>::quiet_NaN() : v[v.size() / 2];
}

/// Collects `figure,value,unit` rows and says them as they come.
class Report {
 public:
    void add(const std::string& figure, double value, const std::string& unit) {
        rows_ << figure << ',' << std::setprecision(6) << value << ',' << unit << '\n';
        std::cout << std::left << std::setw(32) << figure << ' ' << value << ' ' << unit
                  << std::endl;
    }
    bool write(const std::string& file) const {
        std::ofstream out(file);
        out << "figure,value,unit\n" << rows_.str();
        return static_cast<bool>(out);
    }

 private:
    std::ostringstream rows_;
};

struct Timing {
    std::vector<double> merge, cpu, rifts, points, associate, fuse, grow, edges, normals;
    void take(PixelGraph& graph, const View& view) {
        const Stopwatch merging;
        const double before = cpuMs();
        graph.merge(view);
        cpu.push_back(cpuMs() - before);
        merge.push_back(merging.ms());
        const Stopwatch finding;
        graph.rifts();
        rifts.push_back(finding.ms());
        const MergeTimes& t = graph.lastMergeTimes();
        points.push_back(t.points);
        associate.push_back(t.associate);
        fuse.push_back(t.fuse);
        grow.push_back(t.grow);
        edges.push_back(t.edges);
        normals.push_back(t.normals);
    }
    void print(const char* what) const {
        std::cout << "  " << what << ": merge " << median(merge) << " = points " << median(points)
                  << " + associate " << median(associate) << " + fuse " << median(fuse)
                  << " + grow " << median(grow) << " + edges " << median(edges) << " + normals "
                  << median(normals) << "; rifts " << median(rifts) << " ms; merge's cpu "
                  << median(cpu) << " ms\n";
    }
};

/// Views inside of what the first view of the lawn-mower covers: the same in a map of any size.
std::vector<View> revisits(const synthetic::Scene& scene, std::size_t count) {
    std::vector<View> views;
    for (std::size_t i = 0; i < count; ++i) {
        const double a = 0.7 * static_cast<double>(i);
        const Eigen::Vector3d eye(0.15 * std::cos(a), 0.1 * std::sin(a), 2.1);
        views.push_back(synthetic::makeView(
            scene, synthetic::standardCamera(),
            riftmap::lookAt(eye, {0.08 * std::sin(a), 0.05 * std::cos(a), 0}), {0.05, 1000 + i}));
    }
    return views;
}

/// Views that go on where the map ends: about a fifth of each is new.
std::vector<View> explorations(const synthetic::Scene& scene, std::size_t count) {
    std::vector<View> views;
    for (std::size_t i = 0; i < count; ++i) {
        views.push_back(synthetic::makeView(
            scene, synthetic::standardCamera(),
            synthetic::lookDown(-0.6 * static_cast<double>(i + 1), 0.4, 2.6), {0.05, 2000 + i}));
    }
    return views;
}

void againstOctoMap(const synthetic::Scene& scene, Report& report, std::size_t views) {
    for (const double resolution : {0.01, 0.02, 0.05}) {
        malloc_trim(0);
        PixelGraph graph;
        octomap::OcTree tree(resolution);
        std::vector<double> ours, theirs;
        for (std::size_t i = 0; i < views; ++i) {
            const View view = synthetic::makeView(
                scene, synthetic::standardCamera(),
                synthetic::lookDown(0.4 * static_cast<double>(i), 0, 2.6), {0.05, 3000 + i});
            octomap::Pointcloud cloud;
            for (int r = 0; r < view.disparity.height; ++r) {
                for (int c = 0; c < view.disparity.width; ++c) {
                    if (view.disparity.valid(c, r)) {
                        const Eigen::Vector3d p =
                            view.world_T_camera *
                            view.camera.backProject(c, r, view.disparity.at(c, r));
                        cloud.push_back(static_cast<float>(p.x()), static_cast<float>(p.y()),
                                        static_cast<float>(p.z()));
                    }
                }
            }
            const Eigen::Vector3f eye = view.world_T_camera.translation.cast<float>();
            const Stopwatch first;
            graph.merge(view);
            graph.rifts();
            ours.push_back(first.ms());
            const Stopwatch second;
            tree.insertPointCloud(cloud, octomap::point3d(eye.x(), eye.y(), eye.z()));
            theirs.push_back(second.ms());
        }
        const std::string name =
            "octomap_" + std::to_string(static_cast<int>(std::lround(resolution * 100))) + "cm_";
        report.add(name + "ms_median", median(theirs), "ms");
        report.add(name + "time_ratio", median(theirs) / median(ours), "1");
        report.add(
            name + "memory_ratio",
            static_cast<double>(tree.memoryUsage()) / static_cast<double>(graph.memoryBytes()),
            "1");
    }
}

void secondLap(Report& report, std::size_t perLap) {
    // Around inside of a room, back to the start exactly, and around again.
    synthetic::Scene room;
    room.box({-3, -2.5, 0}, {3, 2.5, 2.7}).box({-0.4, -0.4, 0}, {0.4, 0.4, 1});
    PixelGraph graph;
    std::size_t afterFirst = 0;
    for (std::size_t i = 0; i < 2 * perLap; ++i) {
        const double a = 2 * M_PI * static_cast<double>(i % perLap) / static_cast<double>(perLap);
        const Eigen::Vector3d eye(std::cos(a), 0.8 * std::sin(a), 1.3);
        graph.merge(synthetic::makeView(room, synthetic::standardCamera(),
                                        riftmap::lookAt(eye, 2.0 * eye), {0.05, 4000 + i}));
        if (i + 1 == perLap) {
            afterFirst = graph.vertexCount();
        }
    }
    report.add("second_lap_growth",
               static_cast<double>(graph.vertexCount()) / static_cast<double>(afterFirst) - 1, "1");
}

void saveAndLoad(const PixelGraph& graph, Report& report) {
    const std::string file = "/tmp/bench-graph-" + std::to_string(::getpid()) + ".map";
    const Stopwatch saving;
    {
        std::ofstream out(file, std::ios::binary);
        graph.save(out);
    }
    const double saved = saving.ms();
    std::ifstream in(file, std::ios::binary);
    in.seekg(0, std::ios::end);
    const double megabytes = static_cast<double>(in.tellg()) / 1e6;
    in.seekg(0);
    PixelGraph back;
    const Stopwatch loading;
    back.load(in);
    const double loaded = loading.ms();
    std::remove(file.c_str());
    report.add("saved_mb", megabytes, "MB");
    report.add("save_mb_per_s", megabytes / saved * 1e3, "MB/s");
    report.add("load_mb_per_s", megabytes / loaded * 1e3, "MB/s");
}

void queries(const PixelGraph& graph, Report& report) {
    std::vector<Eigen::Vector3f> points;
    const VertexId step = std::max<VertexId>(1, graph.idLimit() / 20000);
    for (VertexId id = 0; id < graph.idLimit(); id += step) {
        if (graph.alive(id)) {
            points.push_back(graph.position(id) + Eigen::Vector3f(0.003F, 0.002F, 0.004F));
        }
    }
    const Stopwatch watch;
    std::size_t found = 0;
    for (const auto& p : points) {
        found += graph.nearest(p, 0.05F) ? 1 : 0;
    }
    report.add("nearest_us", watch.ms() * 1e3 / static_cast<double>(points.size()), "us");
    if (found != points.size()) {
        std::cout << "  " << points.size() - found << " points without a nearest vertex\n";
    }
}

/// Paths through a map of a million vertices; false if the lengths differ.
bool searches(Report& report) {
    PixelGraph graph;
    synthetic::growTo(graph, 1'000'000);
    const riftmap::AstarComparison c = riftmap::compareAstar(graph, 15, 7);
    report.add("astar_vertices", static_cast<double>(graph.vertexCount()), "1");
    report.add("astar_expansions_mean", c.ownExpansions, "1");
    report.add("astar_ms_median", c.ownMs, "ms");
    report.add("astar_boost_ms_median", c.boostMs, "ms");
    report.add("astar_time_ratio_boost", c.ratio, "1");
    report.add("astar_time_ratio_lowest_turn", c.lowestTurn, "1");
    report.add("astar_time_ratio_highest_turn", c.highestTurn, "1");
    report.add("astar_length_difference", c.largestDifference, "1");
    report.add("astar_unreachable", static_cast<double>(c.unreachable), "1");
    if (c.largestDifference >= 1e-9) {
        std::cerr << "bench-graph: A* and Boost.Graph differ in the lengths of shortest paths\n";
        return false;
    }
    return true;
}

/// Maps of what others recorded, also in blocks far smaller than the configuration asks for.
void recordings(Report& report) {
    const char* given = std::getenv("RIFTMAP_DATA");
    const std::string source = RIFTMAP_SOURCE_DIR;
    const std::string data = given != nullptr ? given : source + "/../shared/data";
    struct Recording {
        std::string kind, folder;
        double blockSize;
    };
    for (const auto& [kind, folder, blockSize] :
         {Recording{"kitti", "kitti_odometry/sequence_1", 0},
          {"kitti", "kitti_odometry/sequence_1", 0.5},
          {"euroc", "euroc_v1_01_micro", 0}}) {
        if (!std::filesystem::is_directory(data + "/" + folder)) {
            std::cout << "SKIPPED: no " << data << '/' << folder << " (set RIFTMAP_DATA)\n";
            continue;
        }
        const riftmap::RecordedMemory m = riftmap::recordedMemory(
            kind, data + "/" + folder, source + "/config/" + kind + ".ini", blockSize);
        const std::string name = kind + (blockSize > 0 ? "_small_blocks_" : "_");
        const auto vertices = static_cast<double>(m.vertices);
        report.add(name + "vertices", vertices, "1");
        report.add(name + "bytes_per_vertex", m.mapBytes / vertices, "B");
        report.add(name + "bytes_per_vertex_counted", m.countedBytes / vertices, "B");
        report.add(name + "buffers_mb", m.bufferBytes / 1e6, "MB");
        report.add(name + "merge_ms_median", m.mergeMs, "ms");
        report.add(name + "rifts_ms_median", m.riftsMs, "ms");
    }
}

/// What memory can deliver: reads and writes of large arrays by two threads [GB/s].
double bandwidth() {
    std::vector<std::uint64_t> data(std::size_t{32} << 20U, 1);
    double best = 0;
    for (int repeat = 0; repeat < 5; ++repeat) {
        const Stopwatch watch;
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, data.size(), 1 << 16),
                          [&](const tbb::blocked_range<std::size_t>& range) {
                              for (std::size_t i = range.begin(); i != range.end(); ++i) {
                                  data[i] += 1;
                              }
                          });
        best = std::max(best, 2.0 * 8.0 * static_cast<double>(data.size()) / watch.ms() / 1e6);
    }
    return best;
}

}  // namespace

int main(int argc, char** argv) {
    std::string csv;
    std::size_t vertices = 10'000'000;
    std::size_t octomapViews = 3;
    for (int i = 1; i < argc; ++i) {
        const std::string arg = argv[i];
        if (arg == "--csv" && i + 1 < argc) {
            csv = argv[++i];
        } else if (arg == "--vertices" && i + 1 < argc) {
            vertices = std::stoul(argv[++i]);
        } else if (arg == "--recordings") {
            Report memory;
            recordings(memory);
            return csv.empty() || memory.write(csv) ? 0 : 1;
        } else if (arg == "--astar") {
            Report paths;
            const bool sameLengths = searches(paths);
            return sameLengths && (csv.empty() || paths.write(csv)) ? 0 : 1;
        } else if (arg == "--quick") {
            vertices = 1'000'000;
            octomapViews = 0;
        } else {
            std::cerr << "bench-graph: unknown argument " << arg
                      << ", allowed: --csv FILE, --vertices N, --quick, --recordings, --astar\n";
            return 2;
        }
    }
    Report report;
    const synthetic::Scene scene = synthetic::foldedGround();
    const std::vector<View> inside = revisits(scene, 15);
    Timing small, large, exploring;

    const double before = residentBytes();
    PixelGraph graph;
    synthetic::growTo(graph, 100'000);
    for (const View& view : inside) {
        small.take(graph, view);
    }
    small.print("revisit, small map");
    synthetic::growTo(graph, vertices);
    for (const View& view : inside) {
        large.take(graph, view);
    }
    large.print("revisit, large map");
    const double perVertex = (residentBytes() - before) / static_cast<double>(graph.vertexCount());
    const double buffers = static_cast<double>(graph.bufferBytes());
    for (const View& view : explorations(scene, 15)) {
        exploring.take(graph, view);
    }
    exploring.print("exploring, large map");

    report.add("vertices", static_cast<double>(graph.vertexCount()), "1");
    report.add("edges_per_vertex",
               static_cast<double>(graph.edgeCount()) / static_cast<double>(graph.vertexCount()),
               "1");
    report.add("merge_ms_median", median(exploring.merge), "ms");
    report.add("merge_revisit_ms_median", median(large.merge), "ms");
    report.add("merge_cpu_ms_median", median(exploring.cpu), "ms");
    report.add("rifts_ms_median", median(exploring.rifts), "ms");
    report.add("rifts_revisit_ms_median", median(large.rifts), "ms");
    report.add("merge_growth_1e7_vs_1e5", median(large.merge) / median(small.merge), "1");
    report.add("bytes_per_vertex", perVertex, "B");
    report.add("bytes_per_vertex_counted",
               static_cast<double>(graph.memoryBytes()) / static_cast<double>(graph.vertexCount()),
               "B");
    report.add("buffers_mb_counted", buffers / 1e6, "MB");
    queries(graph, report);
    saveAndLoad(graph, report);
    graph.clear();
    secondLap(report, 24);
    if (octomapViews > 0) {
        againstOctoMap(scene, report, octomapViews);
    }
    if (octomapViews > 0) {
        recordings(report);
    }
    const bool sameLengths = searches(report);
    report.add("bandwidth_gb_per_s", bandwidth(), "GB/s");
    if (!sameLengths) {
        return 1;
    }
    if (!csv.empty() && !report.write(csv)) {
        std::cerr << "bench-graph: cannot write " << csv << '\n';
        return 1;
    }
    return 0;
}
