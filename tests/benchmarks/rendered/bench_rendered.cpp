// SPDX-License-Identifier: BSD-3-Clause
// Are rendered pairs (noise level N4) as hard for a matcher as real ones? The same matchers, scored
// in the same way, on pairs rendered in the built-in worlds and on a real pair with true disparity
// (Middlebury's cones, out of $RIFTMAP_DATA). bench-rendered --csv FILE
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "objects.h"
#include "riftmap/sim/simulated_platform.h"
#include "riftmap/stereo/stereo_matcher.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {
namespace {

/// Over the pixels with truth that both cameras see.
struct Tally {
    double pixels = 0, matched = 0, bad1 = 0, bad2 = 0;
    std::vector<float> small;  ///< |error| of the matches within 1 px

    void add(float truth, float found) {
        ++pixels;
        if (!std::isfinite(found)) {
            return;
        }
        ++matched;
        const float error = std::abs(found - truth);
        bad1 += error > 1 ? 1 : 0;
        bad2 += error > 2 ? 1 : 0;
        if (error <= 1) {
            small.push_back(error);
        }
    }
    double medianError() {
        if (small.empty()) {
            return std::nan("");
        }
        const auto middle = small.begin() + static_cast<std::ptrdiff_t>(small.size() / 2);
        std::nth_element(small.begin(), middle, small.end());
        return static_cast<double>(*middle);
    }
};

struct Matcher {
    const char* name;
    MatcherKind kind;
};

const Matcher kMatchers[] = {{"paper", MatcherKind::kPaper},
                             {"opencv_bm", MatcherKind::kOpenCvBlock},
                             {"opencv_sgbm", MatcherKind::kOpenCvSgbm}};

/// OpenCV's matchers get the uniqueness and the left/right check that suit them, as in the
/// benchmark on real pairs.
StereoOptions optionsFor(const Matcher& matcher) {
    StereoOptions options;
    options.matcher = matcher.kind;
    if (matcher.kind != MatcherKind::kPaper) {
        options.uniqueness = 10;
        options.leftRightTolerance = 1;
    }
    return options;
}

DisparityImage match(const Matcher& matcher, const cv::Mat& left, const cv::Mat& right,
                     const StereoCamera& camera, int numDisparities) {
    StereoOptions options = optionsFor(matcher);
    options.numDisparities = numDisparities;
    StereoObservation observation;
    observation.camera = camera;
    observation.left = left;
    observation.right = right;
    return ViewBuilder(options).build(observation).disparity;
}

/// Views from the starts of a built-in world, four directions at each.
Tally rendered(WorldOptions::Name name, const Matcher& matcher) {
    WorldOptions options;
    options.name = name;
    const World world = makeWorld(options);
    const RayCaster caster(world.mesh);
    const CameraOptions camera;
    const StereoRenderer renderer(world, caster, camera, RenderOptions{});
    Tally tally;
    std::uint64_t seed = 1;
    for (const StartPose& start : world.starts) {
        const bool object = name == WorldOptions::Name::kSculpture;
        for (int turn = 0; turn < (object ? 1 : 4); ++turn) {
            StartPose at = start;
            at.yaw += 1.5707963 * turn;
            const auto pair = renderer.renderPair(at.pose(), seed++);
            const Truth truth = renderer.truth(at.pose(), false, true);
            const DisparityImage found =
                match(matcher, pair.left, pair.right, camera.camera(), camera.numDisparities);
            for (int r = 0; r < found.height; ++r) {
                for (int c = camera.numDisparities; c < found.width; ++c) {
                    const auto z = static_cast<double>(truth.depth.at<float>(r, c));
                    if (truth.halfOccluded.at<unsigned char>(r, c) == 0 && std::isfinite(z) &&
                        z >= camera.nearLimit() && z <= camera.farLimit) {
                        tally.add(static_cast<float>(camera.camera().disparity(z)), found.at(c, r));
                    }
                }
            }
        }
    }
    return tally;
}

std::string dataFolder() {
    const char* data = std::getenv("RIFTMAP_DATA");
    return data != nullptr ? data : RIFTMAP_SOURCE_DIR "/../shared/data";
}

/// Middlebury's cones: truth in quarter pixels, 0 unknown, for the left (disp2) and the right
/// image (disp6); seen by both where the two agree within a pixel.
bool real(const Matcher& matcher, Tally& tally) {
    const std::string folder = dataFolder() + "/middlebury/cones/";
    const cv::Mat left = cv::imread(folder + "im2.png");
    const cv::Mat right = cv::imread(folder + "im6.png");
    const cv::Mat truthLeft = cv::imread(folder + "disp2.png", cv::IMREAD_GRAYSCALE);
    const cv::Mat truthRight = cv::imread(folder + "disp6.png", cv::IMREAD_GRAYSCALE);
    if (left.empty() || right.empty() || truthLeft.empty() || truthRight.empty()) {
        return false;
    }
    StereoCamera camera;
    camera.width = left.cols;
    camera.height = left.rows;
    camera.fx = camera.fy = left.cols;
    camera.cx = 0.5 * (left.cols - 1);
    camera.cy = 0.5 * (left.rows - 1);
    camera.baseline = 0.1;
    constexpr int kRange = 64;
    const DisparityImage found = match(matcher, left, right, camera, kRange);
    for (int r = 0; r < left.rows; ++r) {
        for (int c = kRange; c < left.cols; ++c) {
            const float truth = static_cast<float>(truthLeft.at<unsigned char>(r, c)) / 4;
            const int partner = c - static_cast<int>(std::lround(truth));
            if (truth > 0 && partner >= 0 &&
                std::abs(static_cast<float>(truthRight.at<unsigned char>(r, partner)) / 4 -
                         truth) <= 1) {
                tally.add(truth, found.at(c, r));
            }
        }
    }
    return true;
}

void report(std::ostream& csv, const std::string& name, Tally& t) {
    const double matched = 100 * t.matched / t.pixels;
    const double bad1 = 100 * t.bad1 / t.matched;
    const double bad2 = 100 * t.bad2 / t.matched;
    const double median = t.medianError();
    csv << name << ".matched," << matched << ",%\n"
        << name << ".bad1," << bad1 << ",%\n"
        << name << ".bad2," << bad2 << ",%\n"
        << name << ".median_error," << median << ",px\n";
    std::printf("%-24s matched %5.1f %%, off by > 1 px %5.2f %%, > 2 px %5.2f %%, median %.3f px\n",
                name.c_str(), matched, bad1, bad2, median);
}

void scoreObjects(const std::vector<std::string>& settings, std::ostream& csv) {
    const std::pair<const char*, const char*> kMeshes[] = {
        {"bunny", "/objects/stanford_bunny_35k.obj"},
        {"dragon", "/objects/stanford_dragon_res3.ply"}};
    for (const Matcher& matcher : kMatchers) {
        StereoOptions options = optionsFor(matcher);
        if (matcher.kind == MatcherKind::kPaper) {
            OptionTable table;
            options.describe(table);
            for (const std::string& setting : settings) {
                table.set(setting);
            }
        }
        for (const auto& [name, file] : kMeshes) {
            WorldOptions world;
            world.mesh = dataFolder() + file;
            world.meshOptions.size = 1.0;
            if (!std::filesystem::exists(world.mesh)) {
                std::printf("%s: SKIPPED, not in %s\n", name, dataFolder().c_str());
                continue;
            }
            scoreObject(std::string(matcher.name) + "." + name, world, options, csv);
        }
        if (!settings.empty()) {
            break;  // another setting of our matcher: the others do not change
        }
    }
}

void scoreWorlds(std::ostream& csv) {
    for (const Matcher& matcher : kMatchers) {
        for (const auto& [name, world] : {std::pair{"room", WorldOptions::Name::kRoom},
                                          {"rooms", WorldOptions::Name::kRooms},
                                          {"sculpture", WorldOptions::Name::kSculpture}}) {
            Tally tally = rendered(world, matcher);
            report(csv, std::string(matcher.name) + ".rendered_" + name, tally);
        }
        Tally tally;
        if (real(matcher, tally)) {
            report(csv, std::string(matcher.name) + ".real_cones", tally);
        } else {
            std::printf("SKIPPED: the real pair is not there (RIFTMAP_DATA)\n");
        }
    }
}

int run(int argc, char** argv) {
    std::string file, part = "all";
    std::vector<std::string> settings;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string flag = argv[i];
        if (flag == "--csv") {
            file = argv[i + 1];
        } else if (flag == "--part") {
            part = argv[i + 1];
        } else if (flag == "--set") {
            settings.emplace_back(argv[i + 1]);
        } else {
            file.clear();
            break;
        }
    }
    if (file.empty() || argc % 2 == 0) {
        std::fprintf(stderr,
                     "usage: bench-rendered --csv FILE [--part all|worlds|objects] "
                     "[--set Stereo.key=value]... (objects, our matcher alone)\n");
        return 2;
    }
    std::ofstream csv(file);
    csv << "figure,value,unit\n";
    if (part != "objects") {
        scoreWorlds(csv);
    }
    if (part != "worlds") {
        scoreObjects(settings, csv);
    }
    csv.close();
    return csv ? 0 : 1;
}

}  // namespace
}  // namespace riftmap

int main(int argc, char** argv) {
    try {
        return riftmap::run(argc, argv);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench-rendered: %s\n", e.what());
        return 1;
    }
}
