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
/// Works on runs along the rows; strips of rows are labelled in parallel (oneTBB) and then joined,
/// which gives the same groups for any number of threads. Keeps its buffers: one object is used by
/// one thread at a time.
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
    using Runs = std::vector<Run>;

    static std::uint32_t root(Runs& runs, std::uint32_t run);
    static void unite(Runs& runs, std::uint32_t a, std::uint32_t b);
    static void findRuns(const DisparityImage& image, int row, float maxDifference, Runs& runs);
    /// Unites the runs [above, here) of a row with the runs [here, end) of the next one.
    static void joinRows(const DisparityImage& image, std::size_t above, std::size_t here,
                         std::size_t end, float maxDifference, Runs& runs);
    static void label(const DisparityImage& image, int first, int last, float maxDifference,
                      Runs& runs);
    void joinStrips(const DisparityImage& image, float maxDifference);

    std::vector<Runs> strips_;
    Runs runs_;  ///< of the whole image
};

/// Correlation windows make silhouettes fatter: background beside a near surface takes on its
/// disparity. Discards each pixel that has another one within `reach` columns and rows whose
/// disparity is lower by more than `step` [px]. `scratch` is kept from frame to frame by the
/// caller.
void discardSilhouettes(DisparityImage& image, int reach, float step, std::vector<float>& scratch);

}  // namespace riftmap
