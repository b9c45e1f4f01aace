// SPDX-License-Identifier: BSD-3-Clause
#include "import_files.h"

#include <Eigen/Core>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>

#include "riftmap/core/text.h"

namespace riftmap {

std::vector<TextLine> readLines(const std::filesystem::path& file) {
    std::istringstream in(readFile(file));
    std::vector<TextLine> lines;
    std::string line;
    for (std::size_t number = 1; std::getline(in, line); ++number) {
        const auto text = trimmed(line);
        if (!text.empty() && text.front() != '#') {
            lines.push_back({number, text});
        }
    }
    return lines;
}

std::vector<double> numbersIn(const std::string& text, const std::string& where) {
    std::string spaced = text;
    for (char& c : spaced) {
        if (c == ',' || c == ';' || c == '\r' || c == '\n') {
            c = ' ';
        }
    }
    std::vector<double> numbers;
    for (const auto word : words(spaced)) {
        const auto number = toDouble(word);
        if (!number) {
            throw FileError(where + ": '" + std::string(word) + "' is not a number");
        }
        numbers.push_back(*number);
    }
    return numbers;
}

Pose poseOfRows(const std::vector<double>& rows) {
    if (rows.size() < 12) {
        throw std::invalid_argument("a pose takes 12 numbers, not " + std::to_string(rows.size()));
    }
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(rows.data());
    Pose pose;
    pose.rotation = matrix.leftCols<3>();
    pose.translation = matrix.col(3);
    return pose;
}

cv::Mat readImage(const std::filesystem::path& file) {
    if (!std::filesystem::is_regular_file(file)) {
        throw FileError(file.string() + ": no such file");
    }
    cv::Mat image = cv::imread(file.string(), cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH);
    if (image.empty()) {
        throw FileError(file.string() + ": not an image that can be read");
    }
    if (image.depth() != CV_8U) {
        throw FileError(file.string() + ": not an 8-bit image");
    }
    return image;
}

void checkSameSize(const cv::Mat& left, const cv::Mat& right, const std::filesystem::path& leftFile,
                   const std::filesystem::path& rightFile) {
    if (left.size() != right.size()) {
        throw FileError(leftFile.string() + " is " + std::to_string(left.cols) + "x" +
                        std::to_string(left.rows) + " px, " + rightFile.string() + " " +
                        std::to_string(right.cols) + "x" + std::to_string(right.rows));
    }
}

}  // namespace riftmap
