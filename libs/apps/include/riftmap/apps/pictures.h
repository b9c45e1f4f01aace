// SPDX-License-Identifier: BSD-3-Clause
// Pictures of maps, drawn by ourselves: no display, no OpenGL. All return 8-bit BGR images.
#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "riftmap/core/pose.h"
#include "riftmap/core/view.h"
#include "riftmap/graph/pixel_graph.h"

namespace riftmap {

/// Disparity in colour: darker is farther, white has none (Fig. 1b). The scale runs from the 1st to
/// the 99th percentile.
cv::Mat disparityPicture(const DisparityImage& disparity);

/// What is drawn besides the graph. Map frame.
struct MapPictureParts {
    std::vector<Rift> rifts;              ///< arrows along their normals, blue
    std::optional<std::size_t> dominant;  ///< index into rifts: its arrow and vertices in red
    std::vector<Pose> taken;              ///< poses of views, green line with small cameras
    std::vector<Pose> planned;            ///< the way planned, brighter green, its last camera bold
    std::size_t maxArrows = 60;           ///< the largest rifts get one
};

/// The whole map from above and behind the cameras (Figs. 5 and 6).
cv::Mat mapPicture(const PixelGraph& graph, const MapPictureParts& parts, int width = 1280,
                   int height = 800);

/// The vertices and edges near `centre` [m], edges green (low) to red (high) (Fig. 1d), from
/// beside the line of sight of the camera.
/// @param radius half the width of what is shown [m]
cv::Mat graphDetailPicture(const PixelGraph& graph, const Eigen::Vector3d& centre, double radius,
                           const Pose& world_T_camera, int width = 960, int height = 720);

/// Writes an image. Atomic. Throws FileError.
void writePicture(const std::filesystem::path& file, const cv::Mat& picture);

}  // namespace riftmap
