// SPDX-License-Identifier: BSD-3-Clause
// Which colour a point of a world's surface has, as a pixel of a given size sees it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "riftmap/sim/ray_caster.h"
#include "riftmap/sim/world.h"

namespace riftmap {

/// A texture image with its halvings.
class MipMap {
 public:
    MipMap() = default;
    explicit MipMap(const cv::Mat& bgr);
    bool empty() const { return levels_.empty(); }
    int width() const { return levels_.front().cols; }
    int height() const { return levels_.front().rows; }
    /// Trilinear; repeats. `footprint`: side of the pixel in texels of the finest level.
    /// Red, green, blue in 0 .. 1.
    Eigen::Vector3f sample(float u, float v, float footprint) const;

 private:
    Eigen::Vector3f bilinear(std::size_t level, float u, float v) const;
    std::vector<cv::Mat> levels_;
};

/// Not thread-safe to build, then const and thread-safe.
class Appearance {
 public:
    explicit Appearance(const TriangleMesh& mesh);

    /// Unlit colour before noise, red green blue in 0 .. 1. `footprint`: side of the pixel on the
    /// surface [m].
    Eigen::Vector3f colour(const Hit& hit, const Eigen::Vector3f& point, float footprint) const;
    /// The material whose noise lies over this triangle; null if there is a texture or no noise.
    const Material* noiseOf(std::uint32_t triangle) const;
    /// Normal of the front side for shading: smooth where the surface is curved, not over creases.
    Eigen::Vector3f shadingNormal(const Hit& hit) const;
    std::uint32_t materialOf(std::uint32_t triangle) const {
        return mesh_.materialOf.empty() ? 0 : mesh_.materialOf[triangle];
    }

 private:
    void smoothNormals();

    const TriangleMesh& mesh_;
    std::vector<Material> materials_;
    std::vector<MipMap> textures_;                         ///< one a material, may be empty
    std::vector<float> texelsPerMetre_;                    ///< one a triangle, for textured ones
    std::vector<std::array<Eigen::Vector3f, 3>> normals_;  ///< a corner
};

}  // namespace riftmap
