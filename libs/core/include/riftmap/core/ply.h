// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace riftmap {

/// Points of a surface. Map frame, metres.
struct PointCloud {
    std::vector<Eigen::Vector3f> points;               ///< [m]
    std::vector<Eigen::Vector3f> normals;              ///< unit or zero; empty = none known
    std::vector<std::array<std::uint8_t, 3>> colours;  ///< red, green, blue; empty = none known
};

/// Writes binary little-endian vertices `x y z nx ny nz red green blue` (float, uchar): zero
/// normals and white where none are known. Atomic. Throws FileError, or std::invalid_argument if
/// the sizes do not fit together or a comment holds a line end.
void writePly(const std::filesystem::path& file, const PointCloud& cloud,
              const std::vector<std::string>& comments = {});

/// Reads the vertices of any PLY file: ascii or binary of either byte order, numbers of any of
/// PLY's types; other properties, lists and elements (faces) are skipped. Colours of floating-point
/// type are taken as 0 .. 1. Throws FileError (file, line of the header or byte offset, what): no
/// x y z, cut short, a coordinate that is not finite.
PointCloud readPly(const std::filesystem::path& file);

}  // namespace riftmap
