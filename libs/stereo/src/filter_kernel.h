// SPDX-License-Identifier: BSD-3-Clause
// Inner loops over the rows of an image or its disparity, chosen at run time for the machine's
// instruction set; the same bytes with each of them. Infinity: no match.
#pragma once

#include <cstddef>
#include <cstdint>

namespace riftmap::kernel {

/// Writes to `ends` the columns where something begins or ends, rising: i where d[i] differs from
/// d[i - 1] by more than `maxDifference` and not both are infinite; d[-1] counts as infinite.
/// `ends` has room for width + kEndsRoom. Returns how many.
std::size_t findEnds(const float* d, std::size_t width, float maxDifference, std::int32_t* ends);
inline constexpr std::size_t kEndsRoom = 16;

/// out[i] = least of d within `reach` columns of i; both have `width` numbers.
void leastAlong(const float* d, std::size_t width, std::size_t reach, float* out);

/// d[i] = infinity where it exceeds by more than `step` the least of rows[k][i], k in [0, count).
void discardAbove(const float* const* rows, std::size_t count, std::size_t width, float step,
                  float* d);

/// Distance at which growSigma() looks for slope [px].
inline constexpr std::size_t kSlopeReach = 3;

/// sigma[i]^2 += (slope times the steepest of the ways up, down, left and right)^2, over
/// kSlopeReach pixels that are matched. `up`, `down`: the rows so far from the row `d`.
void growSigma(const float* d, const float* up, const float* down, std::size_t width, float slope,
               float* sigma);

/// Rows and columns around a pixel that planeMiddles() looks at [px].
inline constexpr int kPlaneReach = 3;
/// Numbers that a padded row has more than pixels: kPlaneReach on either side.
inline constexpr std::size_t kPlaneRoom = 2 * std::size_t{kPlaneReach};

/// The plane, by least squares, through the disparities around pixel i of a row that differ from
/// its own by `most` at most: out[i] is its value in the middle, or the pixel's own disparity where
/// fewer than six points or no plane are found. rows[k], k in [0, count), is the row first + k rows
/// on from that of the pixels (-kPlaneReach <= first <= 0), from kPlaneReach columns before its
/// first one to as many beyond its last one.
void planeMiddles(const float* const* rows, int count, int first, std::size_t width, float most,
                  float* out);

/// For moveRow(): a row of every plane that DisparityRefiner compares the images in, 0 where a
/// pixel has no partner.
struct ComparedRow {
    const float* compared;    ///< 1: it has one
    const float* gradient;    ///< [grey levels a pixel]
    const float* difference;  ///< [grey levels]
};

/// Step 3 of DisparityRefiner for the pixels of a row. rows[k], k in [0, count): those within
/// kPlaneReach rows, `own` is the row's own index among them. `matched`: sigma of the matcher.
/// `scratch` has room for 6 (width + kPlaneRoom) numbers and holds zeros where the window
/// reaches beyond the row, before the first call and after each.
void moveRow(const ComparedRow* rows, int count, int own, std::size_t width, const float* matched,
             float least, float most, float* scratch, float* d, float* sigma);

/// Side of the blocks of roughness() [px].
inline constexpr int kNoiseBlock = 8;

/// Sum of absolute answers to the mask [1 -2 1; -2 4 -2; 1 -2 1] over a block whose first pixel is
/// `first` (it has neighbours on all sides; `stride` in bytes); -1 where a pixel of the block lies
/// outside 8 .. 247.
std::int32_t roughness(const std::uint8_t* first, std::size_t stride);

}  // namespace riftmap::kernel
