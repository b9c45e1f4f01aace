// SPDX-License-Identifier: BSD-3-Clause
// What the importers share: text files of data sets, read with the place of every error.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "riftmap/core/file.h"
#include "riftmap/core/pose.h"

namespace riftmap {

/// The lines of a file, without '\r', empty ones and those that start with '#' left out.
struct TextLine {
    std::size_t number = 0;  ///< from 1
    std::string text;
};
std::vector<TextLine> readLines(const std::filesystem::path& file);

/// Numbers between blanks, commas or semicolons. Throws FileError with `where`.
std::vector<double> numbersIn(const std::string& text, const std::string& where);

/// The pose [R|t] of which the first three rows of four are given. Throws std::invalid_argument if
/// there are fewer than 12 numbers.
Pose poseOfRows(const std::vector<double>& rows);

/// An image as it is, 8-bit grey or BGR; 16-bit is refused. Throws FileError.
cv::Mat readImage(const std::filesystem::path& file);

/// Throws FileError where the two differ in size.
void checkSameSize(const cv::Mat& left, const cv::Mat& right, const std::filesystem::path& leftFile,
                   const std::filesystem::path& rightFile);

}  // namespace riftmap
