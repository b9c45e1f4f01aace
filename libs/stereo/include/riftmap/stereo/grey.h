// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core/mat.hpp>

namespace riftmap {

/// A rectified pair as 8-bit grey, of one size.
struct GreyPair {
    cv::Mat left, right;  ///< CV_8UC1

    /// What toGreyPair() converts into, kept from frame to frame.
    struct Buffers {
        cv::Mat grey, bits8;
    } leftBuffers, rightBuffers;
};

/// Grey 8-bit versions of a pair (8 or 16 bit; 1, 3 (BGR) or 4 channels). An 8-bit grey image is
/// shared, not copied. 16-bit images are shifted right, both by the same number of bits, so that
/// the brightest sample of the pair just fits: cameras write 10 and 12 bits into 16.
/// Memory is taken for the first pair of a size and format only, but for what OpenCV's conversion
/// of colours takes. Throws std::invalid_argument where an image is empty, has another format, or
/// the sizes differ.
void toGreyPair(const cv::Mat& left, const cv::Mat& right, GreyPair& out);

}  // namespace riftmap
