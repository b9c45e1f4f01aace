// SPDX-License-Identifier: BSD-3-Clause
// Squares drawn into a small depth image, in vector code. The same bits on every machine.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace riftmap {

/// What squares are drawn with.
struct SquareCamera {
    Eigen::Matrix3f rotation;  ///< of camera_T_world
    Eigen::Vector3f translation;
    float fx = 0, fy = 0, cx = 0, cy = 0;  ///< [px of the depth image]
    float half = 0;                   ///< half of a square's edge [m], by fx in both directions
    float nearest = 0, farthest = 0;  ///< depths that are drawn [m], nearest > 0
    int width = 0, height = 0;        ///< of the depth image [px], below 10^6
};

/// Places that squares are drawn around, as many as are drawn at once. Map frame [m].
struct SquareBatch {
    static constexpr std::size_t kMost = 128;
    alignas(64) std::array<float, kMost> x{}, y{}, z{};  ///< those behind `count` may be anything
    std::size_t count = 0;                               ///< kMost at most
};

/// Draws squares that face the camera into the depth image (width * height values, row by row [m]):
/// each pixel whose centre is the nearest to some point of the square takes its depth, if that is
/// less than the pixel's. O(count + pixels drawn). Thread-safe for different images.
void drawSquares(const SquareCamera& camera, const SquareBatch& batch, float* depth);

}  // namespace riftmap
