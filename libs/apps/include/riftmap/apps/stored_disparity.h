// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservationStereoImages.h>

#include <optional>

#include "riftmap/core/view.h"

namespace riftmap {

/// Measured disparity in CObservationStereoImages::imageDisparity, which MRPT 2.5.8 leaves
/// undefined: one channel of 32-bit floats, one row more than the image. Row 0 begins with
///
///     20100503, version (1), firstColumn, minDisparity, maxDisparity, sigma
///
/// and the rest are the disparities [px] row by row, infinite where there is none. `sigma` [px] is
/// that of every valid pixel; where pixels differ it is -1, and their sigmas follow below the
/// disparities as as many rows more. Floats survive the file bit for bit.
void storeDisparity(const DisparityImage& disparity, mrpt::obs::CObservationStereoImages& pair);

/// What storeDisparity() put there; nothing where there is no disparity or it is another program's.
/// Throws std::runtime_error for a version this program does not know or a size that makes no
/// sense.
std::optional<DisparityImage> loadDisparity(const mrpt::obs::CObservationStereoImages& pair);

}  // namespace riftmap
