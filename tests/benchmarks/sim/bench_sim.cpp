// SPDX-License-Identifier: BSD-3-Clause
// How fast pairs are rendered, and how matchable they are.
//   bench-sim [--csv FILE] [--noise CONTRAST]   (World.noise, default 1)
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "riftmap/core/csv.h"
#include "riftmap/sim/simulated_platform.h"
#include "riftmap/stereo/stereo_matcher.h"

namespace {

using namespace riftmap;

struct Figure {
    std::string name;
    double value;
};

class Report {
 public:
    void add(const std::string& name, double value) {
        std::printf("%-44s %10.4g\n", name.c_str(), value);
        figures_.push_back({name, value});
    }
    void write(const std::string& file) const {
        CsvWriter csv(file, {"name", "value"});
        for (const Figure& f : figures_) {
            csv.row({f.name, f.value});
        }
    }

 private:
    std::vector<Figure> figures_;
};

WorldOptions worldNamed(WorldOptions::Name name, double noise) {
    WorldOptions options;
    options.name = name;
    options.noise = noise;
    return options;
}

/// Median over rounds of the time a pair takes [ms].
double medianPairMs(const StereoRenderer& renderer, const std::vector<Pose>& poses) {
    std::vector<double> times;
    for (int round = 0; round < 5; ++round) {
        for (const Pose& pose : poses) {
            const auto start = std::chrono::steady_clock::now();
            renderer.renderPair(pose, static_cast<std::uint64_t>(round));
            times.push_back(
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                    .count());
        }
    }
    std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2),
                     times.end());
    return times[times.size() / 2];
}

/// Shares of pixels in the measured range that match, and of matched ones that are wrong.
void addMatching(Report& report, const std::string& name, const StereoRenderer& renderer,
                 const CameraOptions& camera, const std::vector<Pose>& poses, MatcherKind kind) {
    StereoOptions options;
    options.matcher = kind;
    options.numDisparities = camera.numDisparities;
    const auto matcher = makeStereoMatcher(options);
    std::size_t seen = 0;
    std::size_t matched = 0;
    std::size_t bad1 = 0;
    std::size_t bad2 = 0;
    double error = 0;
    for (const Pose& pose : poses) {
        const auto pair = renderer.renderPair(pose, 1);
        const Truth truth = renderer.truth(pose, false, true);
        DisparityImage found;
        matcher->compute(pair.left, pair.right, found);
        for (int row = 0; row < found.height; ++row) {
            for (int column = camera.numDisparities; column < found.width; ++column) {
                const auto z = static_cast<double>(truth.depth.at<float>(row, column));
                if (z < camera.nearLimit() || !std::isfinite(z) ||
                    truth.halfOccluded.at<unsigned char>(row, column) != 0) {
                    continue;
                }
                ++seen;
                if (!found.valid(column, row)) {
                    continue;
                }
                ++matched;
                const double off = std::abs(static_cast<double>(found.at(column, row)) -
                                            renderer.camera().disparity(z));
                bad1 += off > 1 ? 1U : 0U;
                bad2 += off > 2 ? 1U : 0U;
                error += off <= 1 ? off : 0.0;
            }
        }
    }
    const auto share = [](std::size_t a, std::size_t b) {
        return 100.0 * static_cast<double>(a) / static_cast<double>(b);
    };
    report.add(name + ".matched_percent", share(matched, seen));
    report.add(name + ".off_by_more_than_1px_percent", share(bad1, matched));
    report.add(name + ".off_by_more_than_2px_percent", share(bad2, matched));
    report.add(name + ".mean_error_of_the_rest_px", error / static_cast<double>(matched - bad1));
}

void run(const std::string& csv, double noise) {
    Report report;
    const std::pair<const char*, WorldOptions::Name> worlds[] = {
        {"room", WorldOptions::Name::kRoom},
        {"sculpture", WorldOptions::Name::kSculpture},
        {"courtyard", WorldOptions::Name::kCourtyard},
    };
    for (const auto& [name, kind] : worlds) {
        const World world = makeWorld(worldNamed(kind, noise));
        const RayCaster caster(world.mesh);
        const CameraOptions camera;
        const StereoRenderer renderer(world, caster, camera, {});
        std::vector<Pose> poses;
        for (const StartPose& start : world.starts) {
            poses.push_back(start.pose());
        }
        for (const std::size_t threads : {1U, 2U}) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            report.add(
                std::string(name) + ".pairs_per_second." + std::to_string(threads) + "_threads",
                1e3 / medianPairMs(renderer, poses));
        }
        const std::clock_t before = std::clock();
        for (const Pose& pose : poses) {
            renderer.renderPair(pose, 0);
        }
        report.add(std::string(name) + ".cpu_ms_a_pair",
                   1e3 * static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC /
                       static_cast<double>(poses.size()));
        addMatching(report, std::string(name) + ".paper", renderer, camera, poses,
                    MatcherKind::kPaper);
        addMatching(report, std::string(name) + ".sgbm", renderer, camera, poses,
                    MatcherKind::kOpenCvSgbm);
        addMatching(report, std::string(name) + ".bm", renderer, camera, poses,
                    MatcherKind::kOpenCvBlock);
    }
    if (!csv.empty()) {
        report.write(csv);
    }
}

}  // namespace

int main(int argc, char** argv) {
    std::string csv;
    double noise = 1;
    for (int i = 1; i < argc; ++i) {
        if (std::string(argv[i]) == "--csv" && i + 1 < argc) {
            csv = argv[++i];
        } else if (std::string(argv[i]) == "--noise" && i + 1 < argc) {
            noise = std::atof(argv[++i]);
        } else {
            std::fprintf(stderr,
                         "bench-sim: unknown argument '%s'; allowed: --csv FILE, --noise X\n",
                         argv[i]);
            return 2;
        }
    }
    try {
        run(csv, noise);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "bench-sim: %s\n", error.what());
        return 1;
    }
    return 0;
}
