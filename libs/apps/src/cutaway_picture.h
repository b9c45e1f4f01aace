// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "riftmap/core/pose.h"

namespace riftmap {

/// The map from above and the side, without the surfaces that turn their back: one looks into a
/// room through its ceiling and its nearer walls. Map frame, metres; 8-bit BGR.
/// @param points, normals, colours of the vertices, equally many
/// @param taken poses of the views: yellow line with the camera's directions
cv::Mat cutawayPicture(const std::vector<Eigen::Vector3f>& points,
                       const std::vector<Eigen::Vector3f>& normals,
                       const std::vector<std::array<std::uint8_t, 3>>& colours,
                       const std::vector<Pose>& taken, int width = 1280, int height = 860);

}  // namespace riftmap
