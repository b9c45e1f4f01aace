// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace riftmap {

/// Measures the noise of images. Keeps its buffer: one object is used by one thread at a time.
class NoiseMeter {
 public:
    /// Standard deviation of a sample of `grey` (CV_8UC1) [grey levels], from the image alone.
    ///
    /// After Immerkaer, Fast Noise Variance Estimation, CVIU 1996: the mask [1 -2 1; -2 4 -2; 1 -2
    /// 1], which slopes and straight edges along the axes do not answer to, has a mean absolute
    /// answer of 6 sqrt(2 / pi) sigma to noise. Texture answers, too; hence the mean is taken over
    /// blocks of 8 x 8 px, every second one, and the value is that which a tenth of the blocks lies
    /// below: a fifth too little where there is no texture at all. Blocks with samples within 8
    /// levels of black or white do not count: noise is cut off there. At least 1 / sqrt(12), the
    /// rounding to 8 bits; that, too, where no block counts.
    double measure(const cv::Mat& grey);

 private:
    std::vector<std::int32_t> blocks_;  ///< sums of absolute answers
};

}  // namespace riftmap
