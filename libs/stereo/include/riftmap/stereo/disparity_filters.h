// SPDX-License-Identifier: BSD-3-Clause
// What is taken out of a disparity image after matching.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "riftmap/core/view.h"

namespace riftmap {

/// Paper section IX.B: discards pixels that share no similar disparity with their neighbourhood.
/// Pixels belong together where 4-neighbours differ by at most `maxDifference` [px]; groups of
/// fewer than `minSize` pixels lose their disparity.
///
/// Works on runs along the rows; strips of rows are labelled in parallel (oneTBB) and then joined,
/// which gives the same groups for any number of threads. Keeps its buffers, which hold as many
/// runs as an image of the largest size so far can have: one object is used by one thread at a
/// time.
class IsolatedFilter {
 public:
    void apply(DisparityImage& image, int minSize, float maxDifference);

 private:
    /// Neighbouring pixels of a row, [first, last), that belong together.
    struct Run {
        int row, first, last;
        std::uint32_t group;  ///< a run of the same group, none later; itself: the group's root
        std::uint32_t size;   ///< of the group [px], where the run is its root
    };
    /// Some rows of the image. Its runs follow one another in runs_ from the index of its first
    /// pixel on: a run has one pixel at least, so that strips do not get in each other's way.
    struct Strip {
        std::size_t begin = 0, end = 0;  ///< of its runs
        std::size_t secondRow = 0;       ///< first run that is not of its first row
        std::size_t lastRow = 0;         ///< first run of its last row
        std::vector<std::int32_t> ends;  ///< of the runs of a row
    };

    std::uint32_t root(std::size_t run) const;
    std::uint32_t halveWay(std::uint32_t run);
    void unite(std::uint32_t a, std::uint32_t b);
    void findRuns(const DisparityImage& image, int row, float maxDifference, Strip& strip);
    /// Unites the runs [above, aboveEnd) of a row with the runs [here, end) of the next one.
    void joinRows(const DisparityImage& image, std::size_t above, std::size_t aboveEnd,
                  std::size_t here, std::size_t end, float maxDifference);
    void label(const DisparityImage& image, int first, int last, float maxDifference, Strip& strip);
    void discardSmall(const Strip& strip, int minSize, DisparityImage& image) const;

    std::vector<Strip> strips_;
    std::unique_ptr<Run[]> runs_;  ///< room for one a pixel; what is not used is never touched
    std::size_t room_ = 0;
};

/// Largest `rows` of discardSilhouettes() [px].
inline constexpr int kMaxSilhouetteRows = 12;

/// Correlation windows make silhouettes fatter: background beside a near surface takes on its
/// disparity. Discards each pixel that has another one within `reach` columns and `rows` rows
/// (<= kMaxSilhouetteRows) whose disparity is lower by more than `step` [px]; reach 0: none.
/// `scratch` is kept from frame to frame by the caller.
void discardSilhouettes(DisparityImage& image, int reach, int rows, float step,
                        std::vector<float>& scratch);

/// A window that looks at a slope, an edge or a step mixes disparities: adds to each sigma, in
/// squares, `slope` times the steepest change of disparity per pixel, taken over 3 px up, down,
/// left and right where matched.
void growSigmaWithSlope(DisparityImage& image, float slope);

/// Takes matches off the rim of matched surface whose own pixels say nothing: see apply(). Keeps
/// its buffers: one object is used by one thread at a time.
class RimFilter {
 public:
    /// Beside a textured surface the window still holds some of its texture, so that flat
    /// background (a plain wall, the sky) takes on the surface's disparity. `grey` (8 bit, the left
    /// image) is flat at a pixel where its 3 x 3 neighbourhood spans no more than `texture` grey
    /// levels. Discards
    /// - flat pixels within 3 px of one without a match (columns before image.firstColumn do not
    ///   count), then
    /// - pixels within 2 px of one that is flat and without a match where the pixel itself differs
    ///   from the mean of that neighbourhood by no more than half of `texture`.
    /// texture <= 0: nothing is done.
    void apply(const cv::Mat& grey, int texture, DisparityImage& image);

 private:
    using Bytes = std::vector<std::uint8_t>;

    void measureTexture(const cv::Mat& grey, int texture);
    void markBare(const DisparityImage& image);

    Bytes flat_;                      ///< 1: flat
    std::vector<std::uint16_t> sum_;  ///< of the 3 x 3 grey levels
    Bytes bare_;                      ///< 1: no match, within the field of view
    Bytes beside_;                    ///< 1: bare within 3 columns
};

}  // namespace riftmap
