// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/view_builder.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace riftmap {
namespace {

void requireSize(int width, int height, const StereoCamera& camera, const char* what) {
    if (width != camera.width || height != camera.height) {
        throw std::invalid_argument(
            std::string(what) + " is " + std::to_string(width) + " x " + std::to_string(height) +
            ", the camera " + std::to_string(camera.width) + " x " + std::to_string(camera.height));
    }
}

void fillMissingSigma(DisparityImage& image, double sigma) {
    image.sigma.resize(image.disparity.size(), 0.0F);
    for (std::size_t i = 0; i < image.sigma.size(); ++i) {
        if (std::isfinite(image.disparity[i]) && !(image.sigma[i] > 0)) {
            image.sigma[i] = static_cast<float>(sigma);
        }
    }
}

/// Gives pixels whose depth is known worse than `most` [m] a deviation with which the map takes
/// them for no point of the surface: one that is not known within a third of itself.
void distrustFarPixels(DisparityImage& image, const StereoCamera& camera, double most) {
    constexpr double kUnknown = 0.34;  // a little more than a third, in spite of rounding
    for (std::size_t i = 0; i < image.sigma.size(); ++i) {
        const double d = static_cast<double>(image.disparity[i]);
        if (!std::isfinite(d) || d + camera.doffs <= 0) {
            continue;
        }
        if (camera.depthSigma(camera.depth(d), static_cast<double>(image.sigma[i])) > most) {
            image.sigma[i] =
                std::max(image.sigma[i], static_cast<float>(kUnknown * (d + camera.doffs)));
        }
    }
}

}  // namespace

ViewBuilder::ViewBuilder(const StereoOptions& options)
    : options_(options), matcher_(makeStereoMatcher(options)) {}

View ViewBuilder::build(const StereoObservation& observation) {
    validate(observation.camera);
    View view{.time_ns = observation.time_ns,
              .camera = observation.camera,
              .world_T_camera = observation.world_T_camera,
              .disparity = {},
              .image = observation.left};
    if (observation.disparity) {
        view.disparity = *observation.disparity;
        requireSize(view.disparity.width, view.disparity.height, view.camera, "given disparity");
        fillMissingSigma(view.disparity, options_.sigmaGiven);
        facets_.apply(view.disparity, options_.facetRadius);
    } else if (matcher_) {
        requireSize(observation.left.cols, observation.left.rows, view.camera, "left image");
        matcher_->compute(observation.left, observation.right, view.disparity);
    } else {
        throw std::invalid_argument(
            "[Stereo] matcher = given, but the observation brings no disparity");
    }
    if (options_.maxDepthSigma > 0) {
        distrustFarPixels(view.disparity, view.camera, options_.maxDepthSigma);
    }
    return view;
}

}  // namespace riftmap
