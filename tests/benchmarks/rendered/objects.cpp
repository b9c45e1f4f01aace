// SPDX-License-Identifier: BSD-3-Clause
#include "objects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "riftmap/sim/simulated_platform.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {
namespace {

constexpr double kTolerance = 0.005;  ///< [m]
constexpr double kFar = 0.25;         ///< farther from the surface counts as this far [m]

enum Part : std::size_t { kSilhouette, kGrazing, kInterior, kParts };
const char* const kPartNames[] = {"silhouette", "grazing", "interior"};

/// What the matches of one part of the image are worth.
struct Tally {
    double truth = 0;                 ///< pixels that show surface both cameras see
    double matched = 0;               ///< pixels of any kind that are matched
    double phantom = 0;               ///< of these: they show no surface at all
    double off = 0;                   ///< of the matched: farther than kTolerance from the surface
    double wrong = 0;                 ///< of the matched: farther than kTolerance + 3 sigma
    double n = 0, sum = 0, sum2 = 0;  ///< error / sigma of the matches within 1 px

    void operator+=(const Tally& o) {
        truth += o.truth;
        matched += o.matched;
        phantom += o.phantom;
        off += o.off;
        wrong += o.wrong;
        n += o.n;
        sum += o.sum;
        sum2 += o.sum2;
    }
    double mean() const { return n > 0 ? sum / n : 0; }
    double deviation() const {
        return n > 0 ? std::sqrt(std::max(0.0, sum2 / n - mean() * mean())) : 0;
    }
};

/// Within 6 px of a step of the true disparity of 2 px, or of the rim of all surface.
cv::Mat silhouettes(const cv::Mat& disparity) {
    cv::Mat low, high, mask;
    const cv::Mat ones = cv::Mat::ones(3, 3, CV_8U);
    cv::erode(disparity, low, ones);
    cv::dilate(disparity, high, ones);
    mask = (high - low) >= 2;
    cv::dilate(mask, mask, cv::Mat::ones(11, 11, CV_8U));
    return mask;
}

struct Scene {
    const World& world;
    const RayCaster& caster;
    const StereoRenderer& renderer;
    const CameraOptions& options;
};

/// Adds one view to the tallies of the parts.
void addView(const Scene& scene, const Pose& pose, const DisparityImage& found,
             std::array<Tally, kParts>& tallies) {
    const StereoCamera camera = scene.options.camera();
    const Truth truth = scene.renderer.truth(pose, true, true);
    cv::Mat disparity(truth.depth.size(), CV_32F);  // 0 without surface
    for (int r = 0; r < disparity.rows; ++r) {
        for (int c = 0; c < disparity.cols; ++c) {
            const auto z = static_cast<double>(truth.depth.at<float>(r, c));
            disparity.at<float>(r, c) =
                std::isfinite(z) ? static_cast<float>(camera.disparity(z)) : 0;
        }
    }
    const cv::Mat rim = silhouettes(disparity);
    for (int r = 0; r < found.height; ++r) {
        for (int c = found.firstColumn; c < found.width; ++c) {
            const float d = disparity.at<float>(r, c);
            const Eigen::Vector3d ray =
                pose.rotation * camera.backProject(c, r, camera.disparity(1)).normalized();
            const auto& normal = truth.normals.at<cv::Vec3f>(r, c);
            const double incidence = -ray.dot(Eigen::Vector3d(normal[0], normal[1], normal[2]));
            Tally& t = tallies[rim.at<unsigned char>(r, c) != 0           ? kSilhouette
                               : d > 0 && incidence < std::cos(1.1344640) ? kGrazing
                                                                          : kInterior];
            t.truth += d > 0 && truth.halfOccluded.at<unsigned char>(r, c) == 0 ? 1 : 0;
            if (!found.valid(c, r)) {
                continue;
            }
            const auto at = static_cast<double>(found.at(c, r));
            const auto sigma = static_cast<double>(found.sigma[found.index(c, r)]);
            const auto near = scene.caster.closest(pose * camera.backProject(c, r, at), kFar);
            const double distance = near ? near->distance : kFar;
            ++t.matched;
            t.phantom += d > 0 ? 0 : 1;
            t.off += distance > kTolerance ? 1 : 0;
            t.wrong += distance > kTolerance + 3 * camera.depthSigma(camera.depth(at), sigma);
            const double error = at - static_cast<double>(d);
            if (d > 0 && std::abs(error) <= 1) {
                ++t.n;
                t.sum += error / sigma;
                t.sum2 += error * error / (sigma * sigma);
            }
        }
    }
}

void report(std::ostream& csv, const std::string& name, const Tally& t) {
    const auto of = [](double part, double whole) { return whole > 0 ? 100 * part / whole : 0; };
    const double matched = of(t.matched - t.phantom, t.truth);
    std::printf(
        "%-34s matched %5.1f %%; of these > 5 mm off %5.2f %%, > 5 mm + 3 sigma %5.2f %%, no "
        "surface %5.2f %%; error/sigma %5.2f +- %4.2f\n",
        name.c_str(), matched, of(t.off, t.matched), of(t.wrong, t.matched),
        of(t.phantom, t.matched), t.mean(), t.deviation());
    csv << name << ".matched," << matched << ",%\n"
        << name << ".off_5mm," << of(t.off, t.matched) << ",%\n"
        << name << ".off_5mm_3sigma," << of(t.wrong, t.matched) << ",%\n"
        << name << ".residual," << t.deviation() << ",\n";
}

/// Eye points on a spiral around the object, 1 to 1.7 m from its surface.
std::vector<Pose> viewsAround(const World& world) {
    constexpr int count = 8;
    const Bounds box = bounds(world.mesh);
    std::vector<Pose> poses;
    for (int i = 0; i < count; ++i) {
        const double z = 0.7 * (2 * (i + 0.5) / count - 1);
        const double turn = 2.3999632 * i;
        const double distance = 0.4 * box.size().maxCoeff() + 1.0 + 0.7 * (i % 4) / 3.0;
        const Eigen::Vector3d out(std::sqrt(1 - z * z) * std::cos(turn),
                                  std::sqrt(1 - z * z) * std::sin(turn), z);
        poses.push_back(lookAt(box.centre() + distance * out, box.centre()));
    }
    return poses;
}

using Tallies = std::array<Tally, kParts>;

void reportAll(std::ostream& csv, const std::string& name, const Tallies& tallies) {
    Tally all;
    for (std::size_t part = 0; part < kParts; ++part) {
        report(csv, name + "." + kPartNames[part], tallies[part]);
        all += tallies[part];
    }
    report(csv, name + ".all", all);
}

}  // namespace

void scoreObject(const std::string& name, const WorldOptions& worldOptions,
                 const StereoOptions& options, std::ostream& csv) {
    const World world = makeWorld(worldOptions);
    const RayCaster caster(world.mesh);
    const CameraOptions camera;
    const StereoRenderer renderer(world, caster, camera, RenderOptions{});
    StereoOptions inRange = options;
    inRange.numDisparities = camera.numDisparities;
    ViewBuilder builder(inRange);
    Tallies tallies;
    std::uint64_t seed = 1;
    for (const Pose& pose : viewsAround(world)) {
        const auto pair = renderer.renderPair(pose, seed++);
        StereoObservation observation;
        observation.camera = camera.camera();
        observation.left = pair.left;
        observation.right = pair.right;
        addView({world, caster, renderer, camera}, pose, builder.build(observation).disparity,
                tallies);
    }
    reportAll(csv, name, tallies);
}

}  // namespace riftmap
