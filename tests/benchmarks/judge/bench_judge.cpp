// SPDX-License-Identifier: BSD-3-Clause
// What judging costs: the room, a million vertices, 200,000 samples. bench-judge --csv FILE
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "riftmap/eval/coverage.h"
#include "riftmap/eval/coverage_tracker.h"
#include "riftmap/sim/simulated_platform.h"

namespace riftmap {
namespace {

/// On the wall, and of all threads together: on a busy machine the two differ.
struct Time {
    double wall, cpu;
};

Time seconds(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t cpu = std::clock();
    work();
    return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
            static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC};
}

int run(const std::string& file) {
    const SimulatedPlatform platform(SimulationOptions{}, 0);
    const TriangleMesh& mesh = platform.world().mesh;
    const ViewSpace space =
        viewSpaceOf(platform.limits(), platform.camera(), platform.pose().translation);
    EvalOptions options;
    options.samples = 200000;
    std::optional<CoverageJudge> judge;
    std::ofstream csv(file);
    csv << "figure,value,unit\n";
    const auto add = [&](const std::string& name, const Time& time) {
        csv << name << ',' << time.wall << ",s\n" << name << "_cpu," << time.cpu << ",s\n";
        std::printf("%-28s %8.3f s, %8.3f s of CPU\n", name.c_str(), time.wall, time.cpu);
    };
    add("observable_set",
        seconds([&] { judge.emplace(mesh, platform.rayCaster(), space, options); }));
    options.samples = 1000000;
    options.sampleSeed = 2;
    const SurfaceSamples map = groundTruthSamples(mesh, options);
    for (const std::size_t count : {std::size_t{100000}, std::size_t{1000000}}) {
        const std::span<const Eigen::Vector3f> all(map.points);
        std::vector<Eigen::Vector3f> part;
        for (std::size_t i = 0; i < all.size(); i += all.size() / count) {
            part.push_back(all[i]);
        }
        const std::string name = std::to_string(count / 1000) + "k_vertices";
        std::vector<Time> times;
        for (int i = 0; i < 5; ++i) {
            times.push_back(seconds([&] { judge->coverage(part); }));
        }
        std::sort(times.begin(), times.end(),
                  [](const Time& a, const Time& b) { return a.cpu < b.cpu; });
        add("coverage_" + name, times[2]);
        add("errors_" + name, seconds([&] { judge->vertexErrors(part); }));
    }
    // A map grown by what lies within 1.5 m of a place, a tenth of it moved by later views.
    CoverageTracker tracker(*judge);
    std::vector<Eigen::Vector3f> grown;
    std::vector<Time> times;
    for (std::size_t view = 0; view < 40; ++view) {
        const Eigen::Vector3f place = map.points[view * 7919 * 17 % map.points.size()];
        for (auto& v : grown) {
            if ((v - place).norm() < 0.5F) {
                v.x() += 1e-4F;
            }
        }
        for (std::size_t i = view % 10; i < map.points.size(); i += 10) {
            if ((map.points[i] - place).norm() < 1.5F) {
                grown.push_back(map.points[i]);
            }
        }
        times.push_back(seconds([&] { tracker.update(grown); }));
    }
    std::sort(times.begin(), times.end(),
              [](const Time& a, const Time& b) { return a.cpu < b.cpu; });
    add("coverage_after_a_view", times[20]);
    csv.close();
    return csv ? 0 : 1;
}

}  // namespace
}  // namespace riftmap

int main(int argc, char** argv) {
    if (argc != 3 || std::string(argv[1]) != "--csv") {
        std::fprintf(stderr, "usage: bench-judge --csv FILE\n");
        return 2;
    }
    return riftmap::run(argv[2]);
}
