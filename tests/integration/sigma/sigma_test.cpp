// SPDX-License-Identifier: BSD-3-Clause
// The standard deviation that comes with a disparity is the one that its error has: error / sigma
// of the correct matches (within 1 px of the truth) deviates by 0.8 to 1.25, whatever the noise of
// the images, on real pairs and on rendered ones; so does that of noisy depth after smoothing, and
// on rendered pairs that of refined matches.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "middlebury.h"
#include "riftmap/sim/simulated_platform.h"
#include "riftmap/sim/stereo_renderer.h"
#include "riftmap/stereo/paper_matcher.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {
namespace {

constexpr double kLeast = 0.8, kMost = 1.25;

/// Adds noise of `sigma` grey levels to each sample.
cv::Mat noisy(const cv::Mat& image, double sigma, cv::RNG& rng) {
    cv::Mat noise(image.size(), CV_MAKETYPE(CV_16S, image.channels()));
    rng.fill(noise, cv::RNG::NORMAL, 0, sigma);
    cv::Mat sum;
    cv::add(image, noise, sum, cv::noArray(), CV_8U);
    return sum;
}

class SigmaOfRealPair : public ::testing::TestWithParam<const char*> {};

/// Tsukuba's truth is drawn in whole pixels; no allowance is made for it.
TEST_P(SigmaOfRealPair, IsThatOfTheError) {
    const char* data = std::getenv("RIFTMAP_DATA");
    const std::string folder =
        std::string(data != nullptr ? data : RIFTMAP_SOURCE_DIR "/../shared/data") + "/middlebury";
    const auto pair = bench::loadPair(folder, GetParam());
    if (!pair) {
        GTEST_SKIP() << "NO DATA: " << GetParam() << " is not in " << folder
                     << "; set RIFTMAP_DATA";
    }
    cv::RNG rng(1);
    for (const double noise : {0.0, 3.0, 6.0}) {
        const cv::Mat left = noisy(pair->left, noise, rng);
        const cv::Mat right = noisy(pair->right, noise, rng);
        StereoOptions options;
        options.numDisparities = pair->numDisparities;
        DisparityImage found;
        PaperMatcher(options).compute(left, right, found);
        const double residual = bench::score(*pair, found).residual;
        std::cout << GetParam() << ", " << noise << " grey levels added: " << residual << "\n";
        EXPECT_GE(residual, kLeast) << noise;
        EXPECT_LE(residual, kMost) << noise;
    }
}

INSTANTIATE_TEST_SUITE_P(Middlebury, SigmaOfRealPair,
                         ::testing::Values("motorcycle", "aloe", "cones", "tsukuba"),
                         [](const auto& p) { return std::string(p.param); });

/// What deviates how far; error / sigma of the correct matches.
struct Deviation {
    double n = 0, sum = 0, sum2 = 0;

    void add(double z) {
        ++n;
        sum += z;
        sum2 += z * z;
    }
    double value() const { return std::sqrt(sum2 / n - sum * sum / (n * n)); }
};

/// 255 at silhouettes (within 5 px of a step of 2 px) and where no surface is.
cv::Mat notInterior(const cv::Mat& disparity) {
    cv::Mat low, high, mask;
    const cv::Mat ones = cv::Mat::ones(3, 3, CV_8U);
    cv::erode(disparity, low, ones);
    cv::dilate(disparity, high, ones);
    mask = ((high - low) >= 2) | (disparity <= 0);
    cv::dilate(mask, mask, cv::Mat::ones(11, 11, CV_8U));
    return mask;
}

/// One view of a built-in world: adds the pixels inside of surfaces that are seen at less than 65
/// degrees from their normal.
void addView(WorldOptions::Name name, double sensorNoise, int refine, Deviation& interior) {
    constexpr double kCosine = 0.4226;
    WorldOptions worldOptions;
    worldOptions.name = name;
    const World world = makeWorld(worldOptions);
    const RayCaster caster(world.mesh);
    const CameraOptions rig;
    RenderOptions render;
    render.sensorNoise = sensorNoise;
    const StereoRenderer renderer(world, caster, rig, render);
    const StereoCamera camera = rig.camera();
    const Pose pose = world.starts.front().pose();
    const auto pair = renderer.renderPair(pose, 1);
    const Truth truth = renderer.truth(pose);
    cv::Mat disparity(truth.depth.size(), CV_32F);
    std::transform(truth.depth.begin<float>(), truth.depth.end<float>(), disparity.begin<float>(),
                   [&](float z) {
                       return std::isfinite(z)
                                  ? static_cast<float>(camera.disparity(static_cast<double>(z)))
                                  : 0.0F;
                   });
    const cv::Mat outside = notInterior(disparity);
    StereoOptions options;
    options.numDisparities = rig.numDisparities;
    options.refine = refine;
    DisparityImage found;
    makeStereoMatcher(options)->compute(pair.left, pair.right, found);
    for (int r = 0; r < found.height; ++r) {
        for (int c = found.firstColumn; c < found.width; ++c) {
            const auto& n = truth.normals.at<cv::Vec3f>(r, c);
            const Eigen::Vector3d ray =
                pose.rotation * camera.backProject(c, r, camera.disparity(1)).normalized();
            const double error = static_cast<double>(found.at(c, r)) -
                                 static_cast<double>(disparity.at<float>(r, c));
            if (outside.at<std::uint8_t>(r, c) == 0 && found.valid(c, r) && std::abs(error) <= 1 &&
                -ray.dot(Eigen::Vector3d(n[0], n[1], n[2])) > kCosine) {
                interior.add(error / static_cast<double>(found.sigma[found.index(c, r)]));
            }
        }
    }
}

/// Depth with noise of its own at each pixel, smoothed: of all pixels of a view, the error over
/// sigma and over what it was before.
std::array<Deviation, 2> ofNoisyDepth(WorldOptions::Name name, double sigma) {
    WorldOptions worldOptions;
    worldOptions.name = name;
    const World world = makeWorld(worldOptions);
    const RayCaster caster(world.mesh);
    const CameraOptions rig;
    const StereoRenderer renderer(world, caster, rig, RenderOptions());
    const Pose pose = world.starts.front().pose();
    const Truth truth = renderer.truth(pose, false, true);
    NoiseOptions noise;
    noise.level = NoiseOptions::Level::kN3;
    noise.sigmaD = 0;
    const DisparityImage exact = exactDisparity(truth, rig, noise, 1);
    noise.sigmaD = sigma;
    StereoObservation observation = observe(renderer, rig, noise, pose, 1);
    const View view = ViewBuilder(StereoOptions()).build(observation);
    std::array<Deviation, 2> all;
    for (std::size_t i = 0; i < exact.disparity.size(); ++i) {
        if (exact.disparity[i] < kNoDisparity && view.disparity.disparity[i] < kNoDisparity) {
            const auto error =
                static_cast<double>(view.disparity.disparity[i] - exact.disparity[i]);
            all[0].add(error / static_cast<double>(view.disparity.sigma[i]));
            all[1].add(error / sigma);
        }
    }
    return all;
}

TEST(SigmaOfNoisyDepth, IsThatOfTheErrorAfterSmoothing) {
    for (const auto world : {WorldOptions::Name::kRoom, WorldOptions::Name::kRooms,
                             WorldOptions::Name::kSculpture, WorldOptions::Name::kCourtyard}) {
        for (const double sigma : {0.05, 0.25, 0.5}) {
            const auto [all, left] = ofNoisyDepth(world, sigma);
            std::cout << "depth, " << sigma << " px: " << all.value() << ", of the noise "
                      << left.value() << " is left\n";
            EXPECT_LT(left.value(), 0.6) << sigma;
            EXPECT_GT(all.n, 1000);
            EXPECT_GE(all.value(), kLeast) << sigma;
            EXPECT_LE(all.value(), kMost) << sigma;
        }
    }
}

class SigmaOfRenderedPairs : public ::testing::TestWithParam<int> {};

TEST_P(SigmaOfRenderedPairs, IsThatOfTheErrorInsideOfSurfaces) {
    for (const double noise : {0.0, 1.5, 4.0}) {
        Deviation all;
        for (const auto world : {WorldOptions::Name::kRoom, WorldOptions::Name::kRooms,
                                 WorldOptions::Name::kSculpture, WorldOptions::Name::kCourtyard}) {
            addView(world, noise, GetParam(), all);
        }
        std::cout << "rendered, sensor noise " << noise << ": " << all.value() << "\n";
        EXPECT_GT(all.n, 10000);
        EXPECT_GE(all.value(), kLeast) << noise;
        EXPECT_LE(all.value(), kMost) << noise;
    }
}

INSTANTIATE_TEST_SUITE_P(Refined, SigmaOfRenderedPairs, ::testing::Values(0, 2));

}  // namespace
}  // namespace riftmap
