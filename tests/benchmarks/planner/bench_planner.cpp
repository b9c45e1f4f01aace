// SPDX-License-Identifier: BSD-3-Clause
// What planning costs, whole and by part: around an object and in a room, exact depth, the views
// that the planner takes. bench-planner --csv FILE
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "riftmap/planner/surface_explorer.h"
#include "riftmap/planner/view_scorer.h"
#include "riftmap/sim/simulated_platform.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {
namespace {

double milliseconds(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

double share(std::vector<double> values, double part) {
    std::sort(values.begin(), values.end());
    return values.empty()
               ? std::nan("")
               : values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

struct Scene {
    std::string name;
    SimulationOptions simulation;
    GraphOptions graph;
    PlannerOptions planner;
    int views = 0;
};

/// As config/explore-object.ini has it, with the sculpture.
Scene object() {
    Scene scene{"object", {}, {}, {}, 12};
    scene.simulation.world.name = WorldOptions::Name::kSculpture;
    scene.graph.targetResolution = 0.005;
    scene.graph.gamma = 0.003;
    scene.planner.viewCost = 2;
    scene.planner.unknownWeight = 1;
    scene.planner.backgroundIsFree = true;
    return scene;
}

/// As config/explore-room.ini has it.
Scene room() {
    Scene scene{"room", {}, {}, {}, 40};
    scene.simulation.world.name = WorldOptions::Name::kRoom;
    scene.graph.targetResolution = 0.02;
    scene.planner.viewCost = 6;
    return scene;
}

/// Times of the parts of a plan, all of one map.
struct Parts {
    std::vector<double> ways, sights, lines;  ///< [ms] a search; [us] a view; [us] a line
};

/// Looks at what is known from the views that the run has taken and from places around them.
void measureParts(const Knowledge& knowledge, const std::vector<Pose>& poses, Parts& parts) {
    FreeSpace space = knowledge.space();
    for (int i = 0; i < 5; ++i) {
        parts.ways.push_back(
            milliseconds([&] { space.updateReach(knowledge.camera().translation); }));
    }
    ViewScorer::Weights weights;
    weights.gapsByLine = knowledge.surfaceBox().has_value();
    ViewScorer scorer(knowledge.sensor(), knowledge.summary(), knowledge.ledger(),
                      knowledge.space(), knowledge.resolution(), weights);
    if (knowledge.surfaceBox()) {
        scorer.setFrontier(knowledge.unseen().frontier(*knowledge.surfaceBox()),
                           knowledge.unseen().voxelSize());
    }
    for (const Pose& pose : poses) {
        if (!knowledge.surfaceBox()) {
            parts.sights.push_back(1000 * milliseconds([&] { scorer.score(pose); }));
            continue;
        }
        ViewScorer::Seen seen;
        parts.sights.push_back(1000 * milliseconds([&] { seen = scorer.sightsAtMost(pose); }));
        const auto lines = static_cast<double>(seen.gaps.size());
        const double whole = milliseconds([&] { scorer.dropHidden(seen.sights, seen.gaps, pose); });
        if (lines > 0) {
            parts.lines.push_back(1000 * whole / lines);
        }
    }
}

void measure(const Scene& scene, std::ofstream& csv) {
    SimulationOptions simulation = scene.simulation;
    simulation.noise.level = NoiseOptions::Level::kN0;
    const bool isObject = scene.name == "object";
    SimulatedPlatform platform(simulation, 0);
    PlannerOptions planner = scene.planner;
    if (isObject) {
        const Bounds box = bounds(platform.world().mesh);
        const Eigen::Vector3d low = box.min.array() - 0.03;
        const Eigen::Vector3d high = box.max.array() + 0.03;
        planner.surfaceBox = {low.x(), low.y(), low.z(), high.x(), high.y(), high.z()};
    }
    PixelGraph graph(scene.graph);
    ViewBuilder builder{StereoOptions{}};
    RiftPlanner rifts;
    StopOptions stop;
    stop.maxViews = scene.views;
    std::vector<double> knowledge, plan;
    std::vector<Pose> poses;
    Parts parts;
    SurfaceExplorer explorer(
        platform, graph, rifts, planner, stop,
        [&](const StereoObservation& o) { return builder.build(o); }, {},
        [&](const ExploreStep& step, const Knowledge& known) {
            poses.push_back(known.camera());
            knowledge.push_back(step.knowledgeMs);
            if (step.planMs > 0) {
                plan.push_back(step.planMs);
            }
            if (static_cast<int>(poses.size()) == scene.views / 2) {
                measureParts(known, poses, parts);
            }
        });
    explorer.run(false);
    const auto add = [&](const std::string& name, const std::vector<double>& values,
                         const char* unit) {
        if (values.empty()) {
            return;
        }
        for (const auto& [part, suffix] : {std::pair(0.5, "median"), std::pair(0.95, "p95")}) {
            const std::string figure = scene.name + "_" + name + "_" + suffix;
            csv << figure << ',' << share(values, part) << ',' << unit << '\n';
            std::printf("%-32s %8.3f %s\n", figure.c_str(), share(values, part), unit);
        }
    };
    add("plan", plan, "ms");            // with the next one
    add("knowledge", knowledge, "ms");  // after a view
    add("ways", parts.ways, "ms");
    add(isObject ? "sights" : "score", parts.sights, "us");  // of a candidate
    add("line", parts.lines, "us");                          // out of a gap, to the camera
}

int run(const std::string& file) {
    std::ofstream csv(file);
    csv << "figure,value,unit\n";
    measure(object(), csv);
    measure(room(), csv);
    csv.close();
    return csv ? 0 : 1;
}

}  // namespace
}  // namespace riftmap

int main(int argc, char** argv) {
    if (argc != 3 || std::string(argv[1]) != "--csv") {
        std::fprintf(stderr, "usage: bench-planner --csv FILE\n");
        return 2;
    }
    return riftmap::run(argv[2]);
}
