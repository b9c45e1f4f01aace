// SPDX-License-Identifier: BSD-3-Clause
// The inner loops of PaperMatcher: plain pointers in and out, chosen at run time for the machine's
// instruction set. Costs are integers and floats are neither contracted nor re-ordered: every
// instruction set gives the same bytes.
//
// Costs are kept a row at a time with the disparities of a pixel side by side, [column][index]:
// the lanes of a vector are disparities, so window sums slide along the row with one addition and
// one subtraction, and a pixel's minimum is found in a few registers.
#pragma once

#include <cstddef>
#include <cstdint>

namespace riftmap::kernel {

/// Disparities are padded to a multiple of the widest vector's lanes.
inline constexpr int kLanes = 32;

enum class Filter { kNone, kDog, kGradient };

/// One prefiltered pair, how it is matched, and where the result goes.
struct MatchJob {
    int width, height;      ///< [px]
    int minDisparity;       ///< [px]
    int numDisparities;     ///< D; index i stands for minDisparity + i
    int paddedDisparities;  ///< D rounded up to kLanes
    int firstColumn;        ///< columns before it are not matched

    const std::uint8_t* left;           ///< `width` a row
    const std::uint8_t* rightReversed;  ///< see reverseRight(); `reversedStride` a row
    std::size_t reversedStride;

    int truncation;     ///< largest absolute difference of one pixel, <= 127 [grey levels]
    int halfWindow;     ///< of the small windows [px]
    int supportOffset;  ///< from the centre to the supporting windows [px]; 0: none
    int penaltySmall;   ///< semi-global pass along the row: a step of one disparity
    int penaltyLarge;   ///< ... any larger step; 0: no pass
    int anchorReach;    ///< how far the pass carries a match beyond pixels sure by themselves [px]
    int anchorMargin;  ///< what is sure by itself: rivals of the window's cost are worse by so much

    bool subpixel;
    bool leftRightCheck;
    int leftRightTolerance;  ///< [px]
    int uniquenessRatio;     ///< rival costs up to best * (1 + this / 65536) + uniquenessMargin ...
    int uniquenessMargin;    ///< ... make a match ambiguous; negative margin: no check
    int minCurvature;        ///< least second difference of the cost at the minimum

    /// sigma^2 = floor^2 + (noise^2 + mismatch^2 max(0, best^2 - explained^2)) / curvature^2 [px^2]
    struct Sigma {
        float floor;      ///< [px]
        float noise;      ///< of the cost's slope [cost]
        float mismatch;   ///< factor
        float explained;  ///< by noise, of the least cost [cost]
    } sigmaModel;

    float* disparity;  ///< [px], infinity = none; `width` a row
    float* sigma;      ///< [px]; `width` a row
};

/// Numbers of 16 bits that matchRows() needs as scratch, aligned to 64 bytes.
std::size_t scratchSize(const MatchJob& job);

/// Matches rows [first, last).
void matchRows(const MatchJob& job, int first, int last, std::uint16_t* scratch);

/// Prefilters rows [first, last) of `image` (stride in bytes) into `out` (width a row).
/// kDog: gain (G(0.7 px) - G(1.75 px)), kGradient: gain Sobel along the row; clipped to +-cap and
/// stored with 128 added. `scratch`: 2 (width + 16) numbers.
void prefilterRows(Filter filter, int gain, int cap, const std::uint8_t* image, std::size_t stride,
                   int width, int height, int first, int last, std::uint16_t* scratch,
                   std::uint8_t* out);

/// out[i] = row[clamp(width - 1 - minDisparity - i)] for i in [0, n): the right row backwards, so
/// that the partners of a left pixel at rising disparity follow one another in memory.
void reverseRight(const std::uint8_t* row, int width, int minDisparity, std::size_t n,
                  std::uint8_t* out);

}  // namespace riftmap::kernel
