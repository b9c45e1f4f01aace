// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "riftmap/core/camera.h"
#include "riftmap/core/options.h"
#include "riftmap/core/pose.h"
#include "riftmap/sim/ray_caster.h"
#include "riftmap/sim/world.h"

namespace riftmap {

/// Section [Camera]: the simulated rig. Two equal pinholes, the right one along +x of the left.
struct CameraOptions {
    int width = 512;                 ///< [px]
    int height = 384;                ///< [px]
    double f = 420;                  ///< focal length [px]
    double cx = -1;                  ///< principal point [px]; < 0: (width - 1) / 2
    double cy = -1;                  ///< [px]; < 0: (height - 1) / 2
    double baseline = 0.12;          ///< [m]
    int numDisparities = 96;         ///< what a matcher searches [px]: the near limit
    double farLimit = 6;             ///< surfaces farther than this are not measured [m]
    std::vector<double> distortion;  ///< k1 k2 p1 p2 k3 of both lenses; empty: none

    StereoCamera camera() const;
    /// f * baseline / num_disparities [m]: nearer surfaces have no match.
    double nearLimit() const { return f * baseline / numDisparities; }
    bool distorted() const;
    void describe(OptionTable& table);
};

/// Section [Render]: light and sensor.
struct RenderOptions {
    double ambient = 0.45;     ///< share of the light that comes from everywhere
    double vignetting = 0.15;  ///< how much darker the corners are, 0 .. 1
    double sensorNoise = 1.5;  ///< standard deviation [grey levels]
    bool colour = true;        ///< three channels (BGR) or one
    int edgeSamples = 2;       ///< an n x n grid of rays where one pixel sees several surfaces
    void describe(OptionTable& table);
};

/// What is known exactly about every pixel of one image.
struct Truth {
    cv::Mat depth;         ///< 32F: z in the camera's frame [m]; infinite where there is no surface
    cv::Mat normals;       ///< 32FC3: unit, world frame, towards the camera; zero without surface
    cv::Mat halfOccluded;  ///< 8U: 255 where the other camera sees no such point: it is hidden,
                           ///< or outside the other image; left image only
};

/// Renders a rig's images of a world by ray casting. Texture images are trilinear mip-mapped; noise
/// loses the octaves that a pixel cannot resolve; pixels on edges get more rays: nothing flickers.
/// World and caster must outlive it. Const members may be called from several threads; each uses
/// all threads there are, and the images do not depend on how many.
class StereoRenderer {
 public:
    StereoRenderer(const World& world, const RayCaster& caster, const CameraOptions& camera,
                   const RenderOptions& render);
    ~StereoRenderer();
    StereoRenderer(const StereoRenderer&) = delete;
    StereoRenderer& operator=(const StereoRenderer&) = delete;

    struct Pair {
        cv::Mat left, right;  ///< 8-bit, 1 or 3 (BGR) channels; distorted if the lens is
    };
    /// `noiseSeed` decides the sensor noise: give every view its own.
    Pair renderPair(const Pose& world_T_left, std::uint64_t noiseSeed) const;

    /// Exact depth, normals and half-occlusion of the left image. No sensor, no light.
    Truth truth(const Pose& world_T_left, bool withNormals = true,
                bool withHalfOcclusion = true) const;

    /// Colours of the left image without noise, textures blurred, one ray a pixel: quick.
    cv::Mat renderQuick(const Pose& world_T_left) const;

    const StereoCamera& camera() const { return camera_; }

 private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
    StereoCamera camera_;
};

}  // namespace riftmap
