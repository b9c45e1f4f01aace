// SPDX-License-Identifier: BSD-3-Clause
// What is taken out of a disparity image after matching.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "riftmap/core/view.h"

namespace riftmap {

/// Paper section IX.B: discards pixels that share no similar disparity with their neighbourhood.
/// Pixels belong together where 4-neighbours differ by at most `maxDifference` [px]; groups of
/// fewer than `minSize` pixels lose their disparity.
///
/// Works on runs along the rows, in two passes. Keeps its buffers: one object is used by one
/// thread at a time.
class IsolatedFilter {
 public:
    void apply(DisparityImage& image, int minSize, float maxDifference);

 private:
    /// Neighbouring pixels of a row, [first, last), that belong together.
    struct Run {
        int row, first, last;
        std::uint32_t group;  ///< a run of the same group; itself: the group's root
        std::uint32_t size;   ///< of the group [px], where the run is its root
    };
    void findRuns(const DisparityImage& image, int row, float maxDifference);
    void joinRows(const DisparityImage& image, std::size_t above, std::size_t here,
                  float maxDifference);
    std::uint32_t root(std::uint32_t run);
    void unite(std::uint32_t a, std::uint32_t b);

    std::vector<Run> runs_;
};

/// Correlation windows make silhouettes fatter: background beside a near surface takes on its
/// disparity. Discards each pixel that has another one within `reach` columns and rows whose
/// disparity is lower by more than `step` [px]. `scratch` is kept from frame to frame by the
/// caller.
void discardSilhouettes(DisparityImage& image, int reach, float step, std::vector<float>& scratch);

}  // namespace riftmap
