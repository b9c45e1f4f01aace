// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "riftmap/core/view.h"

namespace riftmap {

/// Paper section IX.B: discards pixels that share no similar disparity with their neighbourhood.
/// Pixels belong together where 4-neighbours differ by at most `maxDifference` [px]; groups of
/// fewer than `minSize` pixels lose their disparity.
void removeIsolated(DisparityImage& image, int minSize, float maxDifference);

}  // namespace riftmap
