// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/image_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace riftmap {
namespace {

/// A ramp over the whole image, coarse texture in its right half, lens borders in black.
cv::Mat scene() {
    cv::Mat image(240, 320, CV_8UC1);
    for (int r = 0; r < image.rows; ++r) {
        for (int c = 0; c < image.cols; ++c) {
            image.at<std::uint8_t>(r, c) = static_cast<std::uint8_t>(60 + c / 4 + r / 4);
        }
    }
    cv::Mat texture(image.rows, image.cols / 2, CV_8UC1);
    cv::RNG rng(4);
    rng.fill(texture, cv::RNG::UNIFORM, 20, 236);
    cv::GaussianBlur(texture, texture, {5, 5}, 1.0);
    texture.copyTo(image.colRange(image.cols / 2, image.cols));
    return image;
}

TEST(NoiseMeter, FindsTheNoiseOfATexturedSceneWithBlackBorders) {
    cv::RNG rng(7);
    NoiseMeter meter;
    for (const double noise : {1.0, 2.0, 4.0, 8.0}) {
        cv::Mat image = scene(), added(image.size(), CV_16SC1);
        rng.fill(added, cv::RNG::NORMAL, 0, noise);
        cv::add(image, added, image, cv::noArray(), CV_8U);
        image.rowRange(0, 50).setTo(0);  // cut off: a fifth of the blocks says nothing
        const double measured = meter.measure(image);
        EXPECT_GT(measured, 0.75 * noise);  // the tenth of the blocks lies below their mean
        EXPECT_LT(measured, 1.1 * noise);
    }
}

TEST(NoiseMeter, IsNeverLessThanTheRounding) {
    const double rounding = 1 / std::sqrt(12.0);
    NoiseMeter meter;
    for (const auto size :
         {cv::Size(1, 1), cv::Size(9, 9), cv::Size(10, 10), cv::Size(200, 3), cv::Size(320, 240)}) {
        for (const int level : {0, 128, 255}) {
            EXPECT_EQ(meter.measure(cv::Mat(size, CV_8UC1, cv::Scalar(level))), rounding);
        }
    }
}

}  // namespace
}  // namespace riftmap
