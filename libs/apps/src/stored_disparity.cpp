// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/stored_disparity.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace riftmap {
namespace {

constexpr float kMark = 20100503.0F;  // even: exact in single precision
constexpr float kVersion = 1.0F;
constexpr int kHeader = 6;

/// The sigma that all valid pixels share, or -1.
float commonSigma(const DisparityImage& image) {
    float common = -1;
    for (std::size_t i = 0; i < image.disparity.size(); ++i) {
        if (!std::isfinite(image.disparity[i])) {
            continue;
        }
        if (common < 0) {
            common = image.sigma[i];
        } else if (image.sigma[i] != common) {
            return -1;
        }
    }
    return std::max(common, 0.0F);
}

}  // namespace

void storeDisparity(const DisparityImage& image, mrpt::obs::CObservationStereoImages& pair) {
    if (image.width < kHeader) {
        throw std::invalid_argument("a disparity image less than 6 px wide cannot be stored");
    }
    const float sigma = commonSigma(image);
    const int rows = 1 + image.height * (sigma < 0 ? 2 : 1);
    cv::Mat out(rows, image.width, CV_32FC1, cv::Scalar(0));
    float* data = out.ptr<float>(0);
    const float header[kHeader] = {kMark,
                                   kVersion,
                                   static_cast<float>(image.firstColumn),
                                   image.minDisparity,
                                   image.maxDisparity,
                                   sigma};
    std::copy(std::begin(header), std::end(header), data);
    data += image.width;
    data = std::copy(image.disparity.begin(), image.disparity.end(), data);
    if (sigma < 0) {
        std::copy(image.sigma.begin(), image.sigma.end(), data);
    }
    pair.hasImageDisparity = true;
    pair.imageDisparity = mrpt::img::CImage(out, mrpt::img::DEEP_COPY);
}

std::optional<DisparityImage> loadDisparity(const mrpt::obs::CObservationStereoImages& pair) {
    if (!pair.hasImageDisparity || pair.imageDisparity.isExternallyStored() ||
        pair.imageDisparity.isEmpty()) {
        return std::nullopt;
    }
    const cv::Mat& in = pair.imageDisparity.asCvMatRef();
    if (in.type() != CV_32FC1 || in.cols < kHeader || !in.isContinuous() ||
        in.ptr<float>(0)[0] != kMark) {
        return std::nullopt;
    }
    const float* data = in.ptr<float>(0);
    if (data[1] != kVersion) {
        throw std::runtime_error("stored disparity of version " + std::to_string(data[1]) +
                                 ", this program reads version 1");
    }
    DisparityImage image;
    const auto height = static_cast<int>(pair.leftCamera.nrows);
    image.resize(in.cols, height);
    image.firstColumn = static_cast<int>(data[2]);
    image.minDisparity = data[3];
    image.maxDisparity = data[4];
    const float sigma = data[5];
    if (in.rows != 1 + height * (sigma < 0 ? 2 : 1) ||
        in.cols != static_cast<int>(pair.leftCamera.ncols) || image.firstColumn < 0 ||
        image.firstColumn > in.cols) {
        throw std::runtime_error("stored disparity of " + std::to_string(in.cols) + "x" +
                                 std::to_string(in.rows) + " px does not fit its camera");
    }
    data += in.cols;
    const std::size_t n = image.disparity.size();
    std::copy_n(data, n, image.disparity.begin());
    for (std::size_t i = 0; i < n; ++i) {
        if (std::isfinite(image.disparity[i])) {
            image.sigma[i] = sigma < 0 ? data[n + i] : sigma;
        }
    }
    return image;
}

}  // namespace riftmap
