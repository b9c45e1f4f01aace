// SPDX-License-Identifier: BSD-3-Clause
// The inner loops of PaperMatcher: plain pointers in and out, chosen at run time for the machine's
// instruction set. Integers throughout: every instruction set gives the same bytes.
//
// Cost volumes are kept a row at a time with the disparities of a pixel side by side, [column][d]:
// the lanes of a vector are disparities, so window sums slide along the row with one addition and
// one subtraction, and each pixel's minimum is found in a few registers.
#pragma once

#include <cstddef>
#include <cstdint>

namespace riftmap::kernel {

/// Disparities are padded to a multiple of the widest vector's lanes.
inline constexpr int kLanes = 32;

enum class Filter { kNone, kDog, kGradient };

/// One prefiltered pair and how it is matched.
struct MatchJob {
    int width, height;                  ///< [px]
    int numDisparities;                 ///< D
    int paddedDisparities;              ///< D rounded up to kLanes
    const std::uint8_t* left;           ///< row-major, `width` a row
    const std::uint8_t* rightReversed;  ///< see reverseRight(); `reversedStride` a row
    std::size_t reversedStride;
    int truncation;     ///< largest absolute difference of one pixel [grey levels]
    int halfWindow;     ///< of the small windows that are summed [px]
    int supportOffset;  ///< of the supporting windows [px]; 0: one window
    int penaltySmall;   ///< of the semi-global pass along the row; both 0: no pass
    int penaltyLarge;

    int columns() const { return width; }
    int padding() const { return halfWindow; }
};

/// What is known of each pixel of a row after the search.
struct RowResult {
    std::uint16_t* best;        ///< least cost; `width` of each
    std::uint16_t* bestIndex;   ///< its disparity index, the lowest of equals
    std::uint16_t* second;      ///< least cost further than one from it; 65535 where none
    std::uint16_t* before;      ///< cost at bestIndex - 1; 65535 where none
    std::uint16_t* after;       ///< cost at bestIndex + 1; 65535 where none
    std::uint16_t* rightIndex;  ///< best disparity index of the pixel's partner
};

/// Numbers of 16 bits that matchRows() needs as scratch.
std::size_t scratchSize(const MatchJob& job);

/// Rows [first, last): calls done(context, row, result) after each, in order.
void matchRows(const MatchJob& job, int first, int last, std::uint16_t* scratch,
               void (*done)(void* context, int row, const RowResult& result), void* context);

/// Prefilters rows [first, last) of `image` (stride in bytes) into `out` (width a row).
/// kDog: 128 + gain (G(0.85 px) - G(2 px)), kGradient: 128 + Sobel along the row; clipped to
/// 128 +- cap. `scratch`: 4 * (width + 16) numbers.
void prefilterRows(Filter filter, int gain, int cap, const std::uint8_t* image, std::size_t stride,
                   int width, int height, int first, int last, std::uint16_t* scratch,
                   std::uint8_t* out);

/// out[i] = row[clamp(width - 1 - minDisparity - i)] for i in [0, n): the right row backwards, so
/// that the partners of a left pixel at rising disparity follow one another in memory.
void reverseRight(const std::uint8_t* row, int width, int minDisparity, std::size_t n,
                  std::uint8_t* out);

}  // namespace riftmap::kernel
