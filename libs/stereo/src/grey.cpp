// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/grey.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

namespace riftmap {
namespace {

std::string sizeText(const cv::Mat& image) {
    return std::to_string(image.cols) + " x " + std::to_string(image.rows);
}

void checkFormat(const cv::Mat& image, const char* which) {
    const std::string name = std::string(which) + " image";
    if (image.empty()) {
        throw std::invalid_argument(name + " is empty");
    }
    const int channels = image.channels();
    if ((image.depth() != CV_8U && image.depth() != CV_16U) || image.dims != 2 ||
        (channels != 1 && channels != 3 && channels != 4)) {
        throw std::invalid_argument(name + ": format " + cv::typeToString(image.type()) +
                                    ", allowed: 8 or 16 bit with 1, 3 or 4 channels");
    }
}

/// The image itself where it is grey already.
cv::Mat toGrey(const cv::Mat& image, cv::Mat& buffer) {
    if (image.channels() == 1) {
        return image;
    }
    cv::cvtColor(image, buffer, image.channels() == 3 ? cv::COLOR_BGR2GRAY : cv::COLOR_BGRA2GRAY);
    return buffer;
}

unsigned maxSample(const cv::Mat& grey) {
    std::uint16_t max = 0;
    for (int r = 0; r < grey.rows; ++r) {
        const auto* row = grey.ptr<std::uint16_t>(r);
        max = std::max(max, *std::max_element(row, row + grey.cols));
    }
    return max;
}

cv::Mat shifted(const cv::Mat& grey, int bits, cv::Mat& buffer) {
    buffer.create(grey.size(), CV_8UC1);
    for (int r = 0; r < grey.rows; ++r) {
        const auto* from = grey.ptr<std::uint16_t>(r);
        std::transform(from, from + grey.cols, buffer.ptr<std::uint8_t>(r),
                       [bits](std::uint16_t v) { return static_cast<std::uint8_t>(v >> bits); });
    }
    return buffer;
}

}  // namespace

void toGreyPair(const cv::Mat& left, const cv::Mat& right, GreyPair& out) {
    checkFormat(left, "left");
    checkFormat(right, "right");
    if (left.size() != right.size()) {
        throw std::invalid_argument("left image is " + sizeText(left) + ", right image " +
                                    sizeText(right) + ": a pair has one size");
    }
    if (left.depth() != right.depth()) {
        throw std::invalid_argument("left image is " + cv::typeToString(left.type()) +
                                    ", right image " + cv::typeToString(right.type()) +
                                    ": a pair has one depth");
    }
    out.left = toGrey(left, out.leftBuffers.grey);
    out.right = toGrey(right, out.rightBuffers.grey);
    if (left.depth() == CV_16U) {
        const unsigned max = std::max(maxSample(out.left), maxSample(out.right));
        const int bits = std::max(0, static_cast<int>(std::bit_width(max)) - 8);
        out.left = shifted(out.left, bits, out.leftBuffers.bits8);
        out.right = shifted(out.right, bits, out.rightBuffers.bits8);
    }
}

}  // namespace riftmap
