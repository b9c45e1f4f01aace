// SPDX-License-Identifier: BSD-3-Clause
// A stereo pair whose disparity is known exactly: random texture, shifted.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <random>

#include "riftmap/core/view.h"

namespace riftmap::test {

inline constexpr int kFarDisparity = 4;    ///< wall: 2.5 m away
inline constexpr int kNearDisparity = 10;  ///< square in the middle: 1 m away

inline StereoCamera pairCamera(int width = 160, int height = 120) {
    StereoCamera camera;
    camera.width = width;
    camera.height = height;
    camera.fx = camera.fy = 100;
    camera.cx = 0.5 * (width - 1);
    camera.cy = 0.5 * (height - 1);
    camera.baseline = 0.1;
    return camera;
}

/// Whether a pixel of the left image shows the near square.
inline bool isNear(int column, int row, const StereoCamera& camera) {
    return column > camera.width / 3 && column < 2 * camera.width / 3 && row > camera.height / 3 &&
           row < 2 * camera.height / 3;
}

/// A wall with a square before it, seen from `world_T_camera` (the picture does not depend on it).
inline StereoObservation texturedPair(std::int64_t time_ns, const Pose& world_T_camera = {},
                                      std::uint32_t seed = 1, int width = 160, int height = 120) {
    StereoObservation observation;
    observation.time_ns = time_ns;
    observation.camera = pairCamera(width, height);
    observation.world_T_camera = world_T_camera;
    std::mt19937 random(seed);
    const auto noise = [&random] {
        // Not std::uniform_int_distribution: its numbers differ between libraries.
        return static_cast<std::uint8_t>(random() >> 24U);
    };
    cv::Mat& left = observation.left;
    cv::Mat& right = observation.right;
    left.create(height, width, CV_8UC1);
    right.create(height, width, CV_8UC1);
    for (int r = 0; r < height; ++r) {
        for (int c = 0; c < width; ++c) {
            left.at<std::uint8_t>(r, c) = noise();
            right.at<std::uint8_t>(r, c) = noise();  // where nothing else is seen
        }
        for (const bool near : {false, true}) {  // the near ones cover the far ones
            for (int c = 0; c < width; ++c) {
                const int at = c - (near ? kNearDisparity : kFarDisparity);
                if (isNear(c, r, observation.camera) == near && at >= 0) {
                    right.at<std::uint8_t>(r, at) = left.at<std::uint8_t>(r, c);
                }
            }
        }
    }
    return observation;
}

}  // namespace riftmap::test
