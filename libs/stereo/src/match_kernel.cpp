// SPDX-License-Identifier: BSD-3-Clause
#include "match_kernel.h"

#include <algorithm>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "match_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace riftmap::kernel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using U16 = std::uint16_t;
using U8 = std::uint8_t;
using D16 = hn::CappedTag<U16, kLanes>;
using D8 = hn::Rebind<U8, D16>;
using V16 = hn::Vec<D16>;

constexpr U16 kWorst = 65535;

/// Scratch of one strip, cut from one block.
struct Strip {
    explicit Strip(const MatchJob& job, U16* scratch)
        : depth(static_cast<std::size_t>(job.paddedDisparities)),
          width(static_cast<std::size_t>(job.width)),
          pad(static_cast<std::size_t>(job.halfWindow)),
          offset(static_cast<std::size_t>(job.supportOffset)),
          ringRows(2 * job.supportOffset + 1) {
        columns = scratch;
        ring = columns + (width + 2 * pad) * depth;
        cost = ring + static_cast<std::size_t>(ringRows) * ringStride();
        path = cost + width * depth;
        rightBest = path + width * depth;
        rightIndex = rightBest + width + depth;
        best = rightIndex + width + depth;
    }
    std::size_t ringStride() const { return (width + 2 * offset) * depth; }
    /// Window sums of this row, column 0.
    U16* windowRow(int row) const {
        return ring + static_cast<std::size_t>(row % ringRows) * ringStride() + offset * depth;
    }

    std::size_t depth, width, pad, offset;
    int ringRows;
    U16* columns;    ///< [column + pad][d]: sums over the height of the window
    U16* ring;       ///< the last rows of window sums
    U16* cost;       ///< [column][d] of the row searched
    U16* path;       ///< [column][d]: the semi-global pass from the left
    U16* rightBest;  ///< by position in the reversed right row
    U16* rightIndex;
    U16* best;  ///< start of the row results
};

HWY_INLINE V16 difference(D8 d8, hn::Vec<D8> a, hn::Vec<D8> b, hn::Vec<D8> limit) {
    const auto ad = hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a));
    (void)d8;
    return hn::PromoteTo(D16(), hn::Min(ad, limit));
}

int clampRow(const MatchJob& job, int row) {
    return std::clamp(row, 0, job.height - 1);
}

/// columns += |L - R| of row `in`, -= that of row `out` (out < -1: nothing to subtract).
void slideDown(const MatchJob& job, const Strip& s, int in, int out, bool subtract) {
    const D16 d16;
    const D8 d8;
    const std::size_t n = hn::Lanes(d16);
    const auto limit = hn::Set(d8, static_cast<U8>(job.truncation));
    const auto rowOf = [&](int r) { return static_cast<std::size_t>(clampRow(job, r)); };
    const U8* leftIn = job.left + rowOf(in) * s.width;
    const U8* leftOut = job.left + rowOf(out) * s.width;
    const U8* rightIn = job.rightReversed + rowOf(in) * job.reversedStride;
    const U8* rightOut = job.rightReversed + rowOf(out) * job.reversedStride;
    for (std::size_t x = 0; x < s.width; ++x) {
        U16* sum = s.columns + (x + s.pad) * s.depth;
        const std::size_t start = s.width - 1 - x;
        const auto lIn = hn::Set(d8, leftIn[x]);
        const auto lOut = hn::Set(d8, leftOut[x]);
        for (std::size_t d = 0; d < s.depth; d += n) {
            auto v = hn::Load(d16, sum + d);
            v = hn::Add(v, difference(d8, lIn, hn::LoadU(d8, rightIn + start + d), limit));
            if (subtract) {
                v = hn::Sub(v, difference(d8, lOut, hn::LoadU(d8, rightOut + start + d), limit));
            }
            hn::Store(v, d16, sum + d);
        }
    }
}

/// Copies the first and last of `width` columns to `pad` columns beyond either end.
void replicateEnds(U16* row, std::size_t width, std::size_t depth, std::size_t pad) {
    for (std::size_t i = 1; i <= pad; ++i) {
        std::memcpy(row - i * depth, row, depth * sizeof(U16));
        std::memcpy(row + (width - 1 + i) * depth, row + (width - 1) * depth, depth * sizeof(U16));
    }
}

/// Column sums -> window sums of one row.
void slideAlong(const Strip& s, U16* windowRow) {
    const D16 d16;
    const std::size_t n = hn::Lanes(d16);
    replicateEnds(s.columns + s.pad * s.depth, s.width, s.depth, s.pad);
    for (std::size_t d = 0; d < s.depth; d += n) {
        const U16* in = s.columns + d;
        auto sum = hn::Zero(d16);
        for (std::size_t x = 0; x < 2 * s.pad; ++x) {
            sum = hn::Add(sum, hn::Load(d16, in + x * s.depth));
        }
        for (std::size_t x = 0; x < s.width; ++x) {
            sum = hn::Add(sum, hn::Load(d16, in + (x + 2 * s.pad) * s.depth));
            hn::Store(sum, d16, windowRow + x * s.depth + d);
            sum = hn::Sub(sum, hn::Load(d16, in + x * s.depth));
        }
    }
    replicateEnds(windowRow, s.width, s.depth, s.offset);
}

/// Centre window plus the better two of the four supporting windows.
void combineWindows(const MatchJob& job, const Strip& s, int row) {
    const D16 d16;
    const std::size_t n = hn::Lanes(d16);
    const U16* centre = s.windowRow(row);
    if (s.offset == 0) {
        std::memcpy(s.cost, centre, s.width * s.depth * sizeof(U16));
        return;
    }
    const std::size_t shift = s.offset * s.depth;
    const U16* above = s.windowRow(clampRow(job, row - job.supportOffset));
    const U16* below = s.windowRow(clampRow(job, row + job.supportOffset));
    for (std::size_t i = 0; i < s.width * s.depth; i += n) {
        const auto a = hn::Load(d16, above + i - shift);
        const auto b = hn::Load(d16, above + i + shift);
        const auto c = hn::Load(d16, below + i - shift);
        const auto e = hn::Load(d16, below + i + shift);
        const auto mixed = hn::Add(hn::Min(a, b), hn::Min(c, e));
        const auto two = hn::Min(mixed, hn::Min(hn::Add(a, b), hn::Add(c, e)));
        hn::Store(hn::Add(hn::Load(d16, centre + i), two), d16, s.cost + i);
    }
}

/// Disparities past the range never win.
void closePadding(const MatchJob& job, const Strip& s) {
    const auto used = static_cast<std::size_t>(job.numDisparities);
    if (used == s.depth) {
        return;
    }
    for (std::size_t x = 0; x < s.width; ++x) {
        std::fill(s.cost + x * s.depth + used, s.cost + (x + 1) * s.depth, kWorst);
    }
}

/// The best match of each pixel of the right row, over all left pixels.
void searchRight(const Strip& s) {
    const D16 d16;
    const std::size_t n = hn::Lanes(d16);
    std::fill(s.rightBest, s.rightBest + s.width + s.depth, kWorst);
    std::fill(s.rightIndex, s.rightIndex + s.width + s.depth, kWorst);
    for (std::size_t x = 0; x < s.width; ++x) {
        const U16* cost = s.cost + x * s.depth;
        const std::size_t start = s.width - 1 - x;
        for (std::size_t d = 0; d < s.depth; d += n) {
            const auto c = hn::Load(d16, cost + d);
            const auto best = hn::LoadU(d16, s.rightBest + start + d);
            const auto index = hn::LoadU(d16, s.rightIndex + start + d);
            const auto better = hn::Lt(c, best);
            hn::StoreU(hn::Min(c, best), d16, s.rightBest + start + d);
            hn::StoreU(hn::IfThenElse(better, hn::Iota(d16, static_cast<U16>(d)), index), d16,
                       s.rightIndex + start + d);
        }
    }
}

/// The best match of each pixel of the left row and the shape of its minimum.
void searchLeft(const Strip& s, const RowResult& out) {
    const D16 d16;
    const std::size_t n = hn::Lanes(d16);
    for (std::size_t x = 0; x < s.width; ++x) {
        const U16* cost = s.cost + x * s.depth;
        auto least = hn::Load(d16, cost);
        for (std::size_t d = n; d < s.depth; d += n) {
            least = hn::Min(least, hn::Load(d16, cost + d));
        }
        least = hn::MinOfLanes(d16, least);
        std::size_t index = 0;
        for (std::size_t d = 0; d < s.depth; d += n) {
            const auto found = hn::FindFirstTrue(d16, hn::Eq(hn::Load(d16, cost + d), least));
            if (found >= 0) {
                index = d + static_cast<std::size_t>(found);
                break;
            }
        }
        // Distance + 1 <= 2 in wrapping arithmetic: the minimum and its neighbours.
        const auto from = hn::Set(d16, static_cast<U16>(index - 1));
        auto second = hn::Set(d16, kWorst);
        for (std::size_t d = 0; d < s.depth; d += n) {
            const auto away = hn::Sub(hn::Iota(d16, static_cast<U16>(d)), from);
            const auto c = hn::Load(d16, cost + d);
            second = hn::Min(second, hn::IfThenElse(hn::Gt(away, hn::Set(d16, U16{2})), c,
                                                    hn::Set(d16, kWorst)));
        }
        out.best[x] = hn::GetLane(least);
        out.bestIndex[x] = static_cast<U16>(index);
        out.second[x] = hn::GetLane(hn::MinOfLanes(d16, second));
        out.before[x] = index > 0 ? cost[index - 1] : kWorst;
        out.after[x] = index + 1 < s.depth ? cost[index + 1] : kWorst;
        out.rightIndex[x] = s.rightIndex[s.width - 1 - x + index];
    }
}

void matchRows(const MatchJob& job, int first, int last, U16* scratch,
               void (*done)(void*, int, const RowResult&), void* context) {
    const Strip s(job, scratch);
    const RowResult out = {s.best,
                           s.best + s.width,
                           s.best + 2 * s.width,
                           s.best + 3 * s.width,
                           s.best + 4 * s.width,
                           s.best + 5 * s.width};
    // Window sums of rows [next - ringRows, next) are in the ring.
    int next = std::max(0, first - job.supportOffset);
    std::fill(s.columns, s.columns + (s.width + 2 * s.pad) * s.depth, U16{0});
    for (int r = next - job.halfWindow; r < next + job.halfWindow; ++r) {
        slideDown(job, s, r, r, false);
    }
    bool fresh = true;  // the first window has nothing above it to leave
    for (int row = first; row < last; ++row) {
        for (; next <= clampRow(job, row + job.supportOffset); ++next) {
            slideDown(job, s, next + job.halfWindow, next - job.halfWindow - 1, !fresh);
            fresh = false;
            slideAlong(s, s.windowRow(next));
        }
        combineWindows(job, s, row);
        closePadding(job, s);
        searchRight(s);
        searchLeft(s, out);
        done(context, row, out);
    }
}

/// One row of a separable filter: `taps` rows summed with their weights.
template <std::size_t N>
void filterDown(const U8* image, std::size_t stride, int width, int height, int row,
                const int (&weights)[N], U16* out) {
    const U8* rows[N];
    for (std::size_t i = 0; i < N; ++i) {
        const int r =
            std::clamp(row + static_cast<int>(i) - static_cast<int>(N / 2), 0, height - 1);
        rows[i] = image + static_cast<std::size_t>(r) * stride;
    }
    for (int x = 0; x < width; ++x) {
        int sum = 0;
        for (std::size_t i = 0; i < N; ++i) {
            sum += weights[i] * rows[i][x];
        }
        out[x] = static_cast<U16>(sum);
    }
}

template <std::size_t N>
HWY_INLINE int weighted(const U16* at, const int (&weights)[N]) {
    int sum = 0;
    for (std::size_t i = 0; i < N; ++i) {
        sum += weights[i] * at[i];
    }
    return sum;
}

constexpr int kNarrow[] = {1, 2, 1};                         // sigma 0.7 px, sum 4
constexpr int kWide[] = {7, 17, 32, 46, 52, 46, 32, 17, 7};  // sigma 2 px, sum 256
constexpr int kReach = 4;

void replicateRow(U16* row, int width) {
    for (int i = 1; i <= kReach; ++i) {
        row[-i] = row[0];
        row[width - 1 + i] = row[width - 1];
    }
}

void prefilterRows(Filter filter, int gain, int cap, const U8* image, std::size_t stride, int width,
                   int height, int first, int last, U16* scratch, U8* out) {
    U16* narrow = scratch + 8;
    U16* wide = narrow + width + 16;
    for (int row = first; row < last; ++row) {
        U8* to = out + static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
        if (filter == Filter::kNone) {
            std::memcpy(to, image + static_cast<std::size_t>(row) * stride,
                        static_cast<std::size_t>(width));
            continue;
        }
        filterDown(image, stride, width, height, row, kNarrow, narrow);
        replicateRow(narrow, width);
        if (filter == Filter::kGradient) {
            for (int x = 0; x < width; ++x) {
                const int v = (narrow[x + 1] - narrow[x - 1]) * gain;
                to[x] = static_cast<U8>(128 + std::clamp(v, -cap, cap));
            }
            continue;
        }
        filterDown(image, stride, width, height, row, kWide, wide);
        replicateRow(wide, width);
        for (int x = 0; x < width; ++x) {
            const int inner = weighted(narrow + x - 1, kNarrow);   // of 16
            const int outer = weighted(wide + x - kReach, kWide);  // of 65536
            const int v = ((inner * 4096 - outer) * gain + 32768) >> 16;
            to[x] = static_cast<U8>(128 + std::clamp(v, -cap, cap));
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace riftmap::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap::kernel {

HWY_EXPORT(matchRows);
HWY_EXPORT(prefilterRows);

std::size_t scratchSize(const MatchJob& job) {
    const auto width = static_cast<std::size_t>(job.width);
    const auto depth = static_cast<std::size_t>(job.paddedDisparities);
    const auto offset = static_cast<std::size_t>(job.supportOffset);
    const auto pad = static_cast<std::size_t>(job.halfWindow);
    return (width + 2 * pad) * depth + (2 * offset + 1) * (width + 2 * offset) * depth +
           2 * width * depth + 2 * (width + depth) + 6 * width;
}

void matchRows(const MatchJob& job, int first, int last, std::uint16_t* scratch,
               void (*done)(void*, int, const RowResult&), void* context) {
    HWY_DYNAMIC_DISPATCH(matchRows)(job, first, last, scratch, done, context);
}

void prefilterRows(Filter filter, int gain, int cap, const std::uint8_t* image, std::size_t stride,
                   int width, int height, int first, int last, std::uint16_t* scratch,
                   std::uint8_t* out) {
    HWY_DYNAMIC_DISPATCH(prefilterRows)
    (filter, gain, cap, image, stride, width, height, first, last, scratch, out);
}

void reverseRight(const std::uint8_t* row, int width, int minDisparity, std::size_t n,
                  std::uint8_t* out) {
    const int start = width - 1 - minDisparity;
    for (std::size_t i = 0; i < n; ++i) {
        out[i] = row[std::clamp(start - static_cast<int>(i), 0, width - 1)];
    }
}

}  // namespace riftmap::kernel
#endif
