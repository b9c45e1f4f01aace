// SPDX-License-Identifier: BSD-3-Clause
// What planning costs on exact depth, around an object and in a room: whole plans of the views that
// the planner takes (all threads), and parts of one halfway (one thread). bench-planner --csv FILE
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>
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

struct Scene {
    std::string name;
    bool aroundObject = false;
    SimulationOptions simulation = {};
    GraphOptions graph = {};
    PlannerOptions planner = {};
    std::size_t views = 0;
};

/// As config/explore-sculpture.ini has it.
Scene object() {
    Scene scene{"object", true};
    scene.views = 12;
    scene.simulation.world.name = WorldOptions::Name::kSculpture;
    scene.graph.targetResolution = 0.01;
    scene.graph.gamma = 0.005;
    scene.planner.viewCost = 2;
    scene.planner.unknownWeight = 1;
    scene.planner.backgroundIsFree = true;
    return scene;
}

/// As config/explore-room.ini has it.
Scene room() {
    Scene scene{"room", false};
    scene.views = 40;
    scene.simulation.world.name = WorldOptions::Name::kRoom;
    scene.graph.targetResolution = 0.02;
    scene.planner.viewCost = 6;
    return scene;
}

/// A figure of which a run gives many values.
struct Times {
    std::string name, unit;
    std::vector<double> values;
};

/// Views from all reachable places: towards the object's middle, or in a room in any direction.
std::vector<Pose> candidates(const Knowledge& known) {
    constexpr int kCandidates = 200;
    std::mt19937 random(1);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    const std::vector<Eigen::Vector3d> eyes = known.space().reachable(2);
    if (eyes.empty()) {
        throw std::runtime_error("no place can be reached");
    }
    std::vector<Pose> poses;
    for (int i = 0; i < kCandidates; ++i) {
        const Eigen::Vector3d eye = eyes[random() % eyes.size()];
        const Eigen::Vector3d any =
            eye + Eigen::Vector3d(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5);
        poses.push_back(known.sensor().lookingAt(
            eye, known.surfaceBox() ? Eigen::Vector3d(known.surfaceBox()->center()) : any));
    }
    return poses;
}

/// Parts of a plan: the search for ways (without passages), and of each candidate what is drawn and
/// weighed, around an object without and with the lines out of gaps. The frontier there keeps the
/// insides of thin shells, which the planner leaves out.
std::vector<Times> partsOf(const Knowledge& known) {
    Times ways{"ways", "ms", {}};
    FreeSpace space = known.space();
    for (int i = 0; i < 15; ++i) {
        ways.values.push_back(milliseconds([&] { space.updateReach(known.camera().translation); }));
    }
    ViewScorer::Weights weights;
    weights.gapsByLine = known.surfaceBox().has_value();
    ViewScorer scorer(known.sensor(), known.summary(), known.ledger(), known.space(),
                      known.resolution(), weights);
    Times score{"score", "us", {}};
    if (!known.surfaceBox()) {
        for (const Pose& pose : candidates(known)) {
            score.values.push_back(1000 * milliseconds([&] { scorer.score(pose); }));
        }
        return {ways, score};
    }
    scorer.setFrontier(known.unseen().frontier(*known.surfaceBox()), known.unseen().voxelSize());
    Times sights{"sights", "us", {}};
    Times line{"line", "us", {}};
    for (const Pose& pose : candidates(known)) {
        ViewScorer::Seen seen;
        sights.values.push_back(1000 * milliseconds([&] { seen = scorer.sightsAtMost(pose); }));
        const auto lines = static_cast<double>(seen.gaps.size());
        const double all = milliseconds([&] { scorer.dropHidden(seen.sights, seen.gaps, pose); });
        if (lines > 0) {
            line.values.push_back(1000 * all / lines);
        }
    }
    return {ways, sights, line};
}

/// The object's box, with the margin that riftmap-explore leaves.
std::vector<double> boxAround(const TriangleMesh& mesh) {
    const Bounds box = bounds(mesh);
    const double margin = 0.02 * box.size().maxCoeff() + 0.01;
    const Eigen::Vector3d low = box.min.array() - margin;
    const Eigen::Vector3d high = box.max.array() + margin;
    return {low.x(), low.y(), low.z(), high.x(), high.y(), high.z()};
}

std::vector<Times> measure(Scene scene) {
    scene.simulation.noise.level = NoiseOptions::Level::kN0;
    SimulatedPlatform platform(scene.simulation, 0);
    if (scene.aroundObject) {
        scene.planner.surfaceBox = boxAround(platform.world().mesh);
    }
    PixelGraph graph(scene.graph);
    ViewBuilder builder{StereoOptions{}};
    RiftPlanner planner;
    StopOptions stop;
    stop.maxViews = static_cast<int>(scene.views);
    Times plan{"plan", "ms", {}};            // with `knowledge` of the view before
    Times knowledge{"knowledge", "ms", {}};  // what a view changes
    std::vector<Times> parts = {{"half of its views", "", {}}};
    SurfaceExplorer explorer(
        platform, graph, planner, scene.planner, stop,
        [&](const StereoObservation& o) { return builder.build(o); }, {},
        [&](const ExploreStep& step, const Knowledge& known) {
            knowledge.values.push_back(step.knowledgeMs);
            if (step.planMs > 0) {
                plan.values.push_back(step.planMs);
            }
            if (knowledge.values.size() == scene.views / 2) {
                parts = partsOf(known);
            }
        });
    explorer.run(false);
    parts.insert(parts.begin(), {plan, knowledge});
    return parts;
}

int run(const std::string& file) {
    std::ofstream csv(file);
    csv << "figure,value,unit\n" << std::flush;  // before minutes are spent
    for (const Scene& scene : {object(), room()}) {
        if (!csv) {
            break;
        }
        for (Times& t : measure(scene)) {
            if (t.values.empty()) {
                throw std::runtime_error(scene.name + " ended before there was a " + t.name);
            }
            std::sort(t.values.begin(), t.values.end());
            for (const int percent : {50, 95}) {
                const std::string figure =
                    scene.name + "_" + t.name + "_p" + std::to_string(percent);
                const std::size_t at = (t.values.size() - 1) * static_cast<std::size_t>(percent);
                const double value = t.values.at(at / 100);
                csv << figure << ',' << value << ',' << t.unit << '\n';
                std::printf("%-24s %8.3f %s\n", figure.c_str(), value, t.unit.c_str());
            }
        }
    }
    csv.close();
    if (!csv) {
        std::fprintf(stderr, "bench-planner: cannot write %s\n", file.c_str());
    }
    return csv ? 0 : 1;
}

}  // namespace
}  // namespace riftmap

int main(int argc, char** argv) {
    if (argc != 3 || std::string(argv[1]) != "--csv") {
        std::fprintf(stderr, "usage: bench-planner --csv FILE\n");
        return 2;
    }
    try {
        return riftmap::run(argv[2]);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "bench-planner: %s\n", error.what());
        return 1;
    }
}
