// SPDX-License-Identifier: BSD-3-Clause
// The data that flows between the stages: observation -> disparity image -> view of the surface.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "riftmap/core/camera.h"
#include "riftmap/core/pose.h"

namespace riftmap {

/// Marks a pixel without a match (Middlebury's convention for PFM files).
inline constexpr float kNoDisparity = std::numeric_limits<float>::infinity();

/// Disparity of every pixel of the left image; row-major, x_left - d = x_right.
struct DisparityImage {
    int width = 0;                 ///< [px]
    int height = 0;                ///< [px]
    std::vector<float> disparity;  ///< [px], kNoDisparity = no match; width * height
    std::vector<float> sigma;      ///< standard deviation of the disparity [px]; width * height

    /// What the matcher could have found at all. Pixels left of `firstColumn` have no partner in
    /// the right image over the whole range: they are no part of the field of view.
    int firstColumn = 0;
    float minDisparity = 0;  ///< [px]; surfaces farther than this one's depth do not match
    float maxDisparity = std::numeric_limits<float>::infinity();  ///< [px]; nearer: no match

    void resize(int w, int h) {
        width = w;
        height = h;
        const auto n = static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
        disparity.assign(n, kNoDisparity);
        sigma.assign(n, 0.0F);
    }
    std::size_t index(int column, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(column);
    }
    float at(int column, int row) const { return disparity[index(column, row)]; }
    bool valid(int column, int row) const { return std::isfinite(at(column, row)); }
};

/// One stereo pair with the pose it was taken from.
struct StereoObservation {
    std::int64_t time_ns = 0;  ///< since the Unix epoch [ns]
    StereoCamera camera;
    Pose world_T_camera;  ///< optical frame of the left camera in the map frame
    cv::Mat left, right;  ///< 8-bit, 1 or 3 (BGR) channels, rectified, continuous
    /// Set by sources that measure disparity themselves (a depth camera; the simulator at noise
    /// levels N0 and N3): no matching is done then.
    std::optional<DisparityImage> disparity;
};

/// What the graph takes in: the surface as one camera pose sees it.
struct View {
    std::int64_t time_ns = 0;  ///< since the Unix epoch [ns]
    StereoCamera camera;
    Pose world_T_camera;  ///< optical frame of the left camera in the map frame
    DisparityImage disparity;
    cv::Mat image;  ///< left image, 8-bit, 1 or 3 (BGR) channels; size of `disparity`
};

}  // namespace riftmap
