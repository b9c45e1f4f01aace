// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <vector>

#include "riftmap/core/pose.h"
#include "riftmap/eval/coverage.h"
#include "riftmap/eval/octomap_check.h"
#include "riftmap/eval/point_index.h"

namespace riftmap {

/// Pictures of a judgement. Surfaces that turn their seen side away are left out, so that one looks
/// into a room through its ceiling and its nearer walls; so are, of a building, the outsides that
/// no one could see. A legend stands above each, beyond the height asked for.
class CoveragePictures {
 public:
    /// `vertices` and `normals` (or empty) of the map; everything given must outlive the pictures.
    CoveragePictures(const CoverageJudge& judge, const TriangleMesh& mesh, const RayCaster& caster,
                     std::span<const Eigen::Vector3f> vertices,
                     std::span<const Eigen::Vector3f> normals);

    /// Where the pictures are taken from: two oblique views, and one from above (a building) or
    /// from below (an object).
    std::size_t viewpoints() const { return eyes_.size(); }

    /// The world: covered at the headline distance green, observable but uncovered red,
    /// unobservable grey-blue. 8-bit BGR.
    cv::Mat coverage(std::size_t viewpoint, int width = 960, int height = 720) const;
    /// The map's vertices by their distance to the world: blue 0, green delta, yellow 2 delta, red
    /// 3 delta and more; the world itself faint behind them. 8-bit BGR.
    cv::Mat errors(std::size_t viewpoint, std::span<const float> vertexErrors, int width = 960,
                   int height = 720) const;

    /// The observable surface by who has its voxel, and if only one has it, why (the legend tells
    /// the colours). 8-bit BGR.
    cv::Mat owners(std::size_t viewpoint, const VoxelOwners& ownerOf, int width = 960,
                   int height = 720) const;

    /// octomap_N.png into the directory.
    void writeOwners(const std::filesystem::path& directory, const VoxelOwners& ownerOf) const;
    /// coverage_N.png and error_N.png into the directory.
    void write(const std::filesystem::path& directory, std::span<const float> vertexErrors) const;

 private:
    struct Eye {
        Pose pose;
        double focal = 0;  ///< [image widths]
    };
    struct Seen {
        Eigen::Vector3d point = Eigen::Vector3d::Zero();
        double shade = 0;  ///< 0 .. 1
        double depth = 0;  ///< [m], 0 = nothing there
        bool observable = false;
    };
    /// The nearest sample on the same side of the same surface, if one is near.
    std::optional<std::uint32_t> sampleOf(const Eigen::Vector3f& point,
                                          const Eigen::Vector3f& normal) const;
    Seen look(const Eye& eye, double column, double row, int width, int height) const;
    template <class Colour>
    cv::Mat paint(const Eye& eye, int width, int height, cv::Mat* depth, Colour&& colour) const;

    const CoverageJudge& judge_;
    const RayCaster& caster_;
    std::span<const Eigen::Vector3f> vertices_, normals_;
    bool building_;
    float reach_;  ///< of the look for the nearest sample [m]
    PointIndex samples_;
    PointIndex map_;
    std::vector<Eye> eyes_;
};

}  // namespace riftmap
