// SPDX-License-Identifier: BSD-3-Clause
// A view as the graph G_{i+1} of the paper: its points, edges and open pixels, before any merge.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "riftmap/core/view.h"
#include "riftmap/graph/pixel_graph.h"

namespace riftmap {

/// Allocated for a vector.
template <class T>
std::size_t bytesOf(const std::vector<T>& values) {
    return values.capacity() * sizeof(T);
}

/// A plane through a patch of the disparity image (planes are linear in disparity):
/// disparity = slopeColumn * dc + slopeRow * dr + value, (dc, dr) from the centre pixel.
struct PatchPlane {
    int column = 0, row = 0;  ///< centre pixel
    float slopeColumn = 0, slopeRow = 0, value = 0;
    float tolerance = -1;  ///< [px] a pixel farther off lies on another surface; < 0: no plane
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< camera frame, towards the camera
    float inverseDistance = 0;                         ///< of the plane from the camera [1/m]

    float disparity(int c, int r) const {
        return value + slopeColumn * static_cast<float>(c - column) +
               slopeRow * static_cast<float>(r - row);
    }
};

/// Buffers are kept from view to view. Not thread-safe; build() runs its loops in parallel.
class ViewPoints {
 public:
    static constexpr std::uint16_t kNoEdge = 0xFFFF;
    static constexpr int kPatch = 4;              ///< side of the patches that share a plane [px]
    static constexpr float kLargestStretch = 10;  ///< beyond 84 degrees no angle explains anything
    /// Bit of `look`: the pixel lies on the plane of its patch.
    static constexpr std::uint32_t kOnPatch = 1U << 24U;
    static constexpr int kPhasePad = 1;  ///< patches of room before a row of phases_

    /// Eqs. (1)-(3) for a checked view; sorts pixels by what their neighbours are.
    void build(const View& view, const GraphOptions& options);

    int width = 0, height = 0;
    std::size_t validCount = 0;
    float fx = 1, fy = 1, cx = 0, cy = 0, fb = 1;
    float footprint = 1;  ///< side of a pixel at a depth of 1 m [m]
    Eigen::Matrix3f rotation = Eigen::Matrix3f::Identity();  ///< world_R_camera
    Eigen::Vector3f translation = Eigen::Vector3f::Zero();   ///< of the camera in the map frame

    std::vector<float> z;          ///< depth [m]; 0 = no vertex
    std::vector<float> sigma;      ///< standard deviation of z [m]
    std::vector<float> disparity;  ///< fb / z [px]; not a number where z = 0
    std::vector<float> stretch;    ///< 1 / cos of the viewing angle in [1, 10]; 0 = unknown
    std::vector<float> area;       ///< surface that the pixel stands for [m^2]
    std::vector<std::uint16_t> right, down;  ///< weight code of the edge there, or kNoEdge
    std::vector<std::uint8_t> kinds;         ///< OpenKind bits but kTooCoarse
    /// Red | green << 8 | blue << 16, grey where the view has no image; kOnPatch.
    std::vector<std::uint32_t> look;
    std::vector<PatchPlane> patches;  ///< a plane a patch, row-major

    std::size_t memoryBytes() const {
        return bytesOf(z) + bytesOf(sigma) + bytesOf(disparity) + bytesOf(stretch) + bytesOf(area) +
               bytesOf(right) + bytesOf(down) + bytesOf(kinds) + bytesOf(look) + bytesOf(patches) +
               bytesOf(rayX_) + bytesOf(rayY_) + bytesOf(phases_);
    }
    std::size_t index(int column, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(column);
    }
    int patchColumns() const { return patchColumns_; }
    const PatchPlane& patch(int column, int row) const {
        return patches[static_cast<std::size_t>(row / kPatch) *
                           static_cast<std::size_t>(patchColumns_) +
                       static_cast<std::size_t>(column / kPatch)];
    }
    /// Distance between neighbouring points of the surface at a pixel [m].
    float spacing(std::size_t pixel) const {
        return z[pixel] * footprint * std::max(1.0F, stretch[pixel]);
    }
    /// Eq. (1) in the camera frame.
    Eigen::Vector3f inCamera(int column, int row, float depth) const {
        return {(static_cast<float>(column) - cx) * depth / fx,
                (static_cast<float>(row) - cy) * depth / fy, depth};
    }
    Eigen::Vector3f inMap(int column, int row) const {
        return rotation * inCamera(column, row, z[index(column, row)]) + translation;
    }
    /// True if the pixel differs from the plane of its patch by the patch's tolerance at most.
    bool onPatch(int column, int row) const { return (look[index(column, row)] & kOnPatch) != 0; }

 private:
    void resize(int newWidth, int newHeight);
    std::size_t computeDepth(const View& view, int row);
    void fitPatches(const DisparityImage& image, int patchRow);
    void computeAngles(const cv::Mat& image, int patchRow);
    float angleFromPatches(int column, int row) const;
    float angleFromNeighbours(int column, int row) const;
    void computeEdges(const GraphOptions& options, int row);
    std::uint16_t explainedByAngle(std::uint16_t code, float target, int c, int r, int c2,
                                   int r2) const;
    bool explained(int c, int r, int c2, int r2, float tolerance) const;
    void computeKinds(const GraphOptions& options, int firstColumn, int row);

    int patchColumns_ = 0, patchRows_ = 0;
    std::vector<float> rayX_, rayY_;  ///< (c - cx) / fx of a column, (r - cy) / fy of a row
    /// The disparities again, for vectors of patches: each row as kPatch planes of phaseStride_
    /// values, columns modulo kPatch, with room before and behind; one more row without vertices.
    std::vector<float> phases_;
    std::size_t phaseStride_ = 0;
    const float* phaseRow(int row) const {
        const int known = row >= 0 && row < height ? row : height;
        return phases_.data() + static_cast<std::size_t>(known * kPatch) * phaseStride_;
    }
};

}  // namespace riftmap
