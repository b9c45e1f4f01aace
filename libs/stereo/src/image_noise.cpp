// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/image_noise.h"

#include <algorithm>
#include <cmath>

#include "filter_kernel.h"

namespace riftmap {

double NoiseMeter::measure(const cv::Mat& grey) {
    constexpr int kSide = kernel::kNoiseBlock;
    constexpr double kAnswer = 6 * 0.79788456;  // mean absolute answer to noise of 1 grey level
    const double rounding = 1 / std::sqrt(12.0);
    blocks_.reserve(grey.total() / (kSide * kSide) + 1);
    blocks_.clear();
    for (int y = 1; y + kSide < grey.rows; y += kSide) {
        for (int x = 1 + (y / kSide) % 2 * kSide; x + kSide < grey.cols; x += 2 * kSide) {
            const std::int32_t sum = kernel::roughness(grey.ptr(y) + x, grey.step[0]);
            if (sum >= 0) {
                blocks_.push_back(sum);
            }
        }
    }
    if (blocks_.empty()) {
        return rounding;
    }
    const auto smooth = blocks_.begin() + static_cast<std::ptrdiff_t>(blocks_.size() / 10);
    std::nth_element(blocks_.begin(), smooth, blocks_.end());
    return std::max(rounding, *smooth / (kSide * kSide * kAnswer));
}

}  // namespace riftmap
