// SPDX-License-Identifier: BSD-3-Clause
#include "match_kernel.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>

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
    Strip(const MatchJob& job, U16* scratch)
        : depth(static_cast<std::size_t>(job.paddedDisparities)),
          stride(depth + kLanes),
          width(static_cast<std::size_t>(job.width)),
          pad(static_cast<std::size_t>(job.halfWindow)),
          offset(static_cast<std::size_t>(job.supportOffset)),
          ringRows(2 * job.supportOffset + 1) {
        columns = scratch;
        ring = columns + (width + 2 * pad) * depth;
        cost = ring + static_cast<std::size_t>(ringRows) * ringStride() + kLanes;
        pathRight = cost + width * stride + kLanes;
        pathLeft = pathRight + width * stride + kLanes;
        rightBest = pathLeft + width * stride;
        rightIndex = rightBest + width + stride;
        best = rightIndex + width + stride;
        ownBest = best + kMinima * resultStride();
    }
    std::size_t ringStride() const { return (width + 2 * offset) * depth; }
    /// Window sums of this row, column 0.
    U16* windowRow(int row) const {
        return ring + static_cast<std::size_t>(row % ringRows) * ringStride() + offset * depth;
    }
    static constexpr std::size_t kMinima = 6;  ///< arrays of Minima
    std::size_t resultStride() const { return width + kLanes; }

    std::size_t depth;   ///< padded disparities
    std::size_t stride;  ///< of a pixel's costs: the padding beyond `depth` holds kWorst
    std::size_t width, pad, offset;
    int ringRows;
    U16* columns;    ///< [column + pad][depth]: sums over the height of the small window
    U16* ring;       ///< the last rows of window sums
    U16* cost;       ///< [column][stride] of the row searched; kWorst before and behind
    U16* pathRight;  ///< likewise: the semi-global pass that goes right
    U16* pathLeft;   ///< likewise: the one that goes left
    U16* rightBest;  ///< by position in the reversed right row
    U16* rightIndex;
    U16* best;     ///< start of the row's minima, see Minima
    U16* ownBest;  ///< likewise, before the semi-global pass
};

/// What the search found for each pixel of a row.
struct Minima {
    Minima(const Strip& s, U16* start)
        : best(start),
          index(best + s.resultStride()),
          ambiguous(index + s.resultStride()),
          before(ambiguous + s.resultStride()),
          after(before + s.resultStride()),
          partner(after + s.resultStride()) {}
    U16* best;       ///< least cost
    U16* index;      ///< where, the lowest of equals
    U16* ambiguous;  ///< 1: another minimum is nearly as good
    U16* before;     ///< cost at index - 1
    U16* after;      ///< cost at index + 1
    U16* partner;    ///< the best index of the pixel's partner in the right image
};

/// Smallest lane. Halved down to one block, for which x86 has an instruction.
template <class D>
HWY_INLINE U16 smallest(D d, hn::Vec<D> v) {
#if HWY_TARGET != HWY_SCALAR
    if constexpr (hn::MaxLanes(D()) > 8) {
        const hn::Half<D> half;
        return smallest(half, hn::Min(hn::LowerHalf(half, v), hn::UpperHalf(half, v)));
    }
#endif
    return hn::GetLane(hn::MinOfLanes(d, v));
}

HWY_INLINE hn::Vec<D8> difference(hn::Vec<D8> a, hn::Vec<D8> b, hn::Vec<D8> limit) {
    return hn::Min(hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a)), limit);
}

int clampRow(const MatchJob& job, int row) {
    return std::clamp(row, 0, job.height - 1);
}

/// columns += |L - R| of row `in`, and -= that of row `out` where there is one to leave.
void slideDown(const MatchJob& job, const Strip& s, int in, int out, bool leave) {
    const D16 d16;
    const D8 d8;
    const hn::RebindToSigned<D16> i16;
    const hn::RebindToSigned<D8> i8;
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
            auto change = difference(lIn, hn::LoadU(d8, rightIn + start + d), limit);
            if (leave) {  // differences are at most 127: the change fits a signed byte
                change =
                    hn::Sub(change, difference(lOut, hn::LoadU(d8, rightOut + start + d), limit));
            }
            const auto wide = hn::PromoteTo(i16, hn::BitCast(i8, change));
            hn::Store(hn::Add(hn::Load(d16, sum + d), hn::BitCast(d16, wide)), d16, sum + d);
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

/// Cost of columns [from, to): the centre window plus the better two of the four supporting ones.
void combineWindows(const MatchJob& job, const Strip& s, int row, std::size_t from,
                    std::size_t to) {
    const D16 d16;
    const std::size_t n = hn::Lanes(d16);
    const auto used = static_cast<std::size_t>(job.numDisparities);
    const std::size_t shift = s.offset * s.depth;
    const U16* centre = s.windowRow(row);
    const U16* above = s.windowRow(clampRow(job, row - job.supportOffset));
    const U16* below = s.windowRow(clampRow(job, row + job.supportOffset));
    for (std::size_t x = from; x < to; ++x) {
        U16* out = s.cost + x * s.stride;
        for (std::size_t d = 0; d < s.depth; d += n) {
            const std::size_t i = x * s.depth + d;
            auto cost = hn::Load(d16, centre + i);
            if (shift != 0) {
                const auto a = hn::Load(d16, above + i - shift);
                const auto b = hn::Load(d16, above + i + shift);
                const auto c = hn::Load(d16, below + i - shift);
                const auto e = hn::Load(d16, below + i + shift);
                const auto mixed = hn::Add(hn::Min(a, b), hn::Min(c, e));
                cost = hn::Add(cost, hn::Min(mixed, hn::Min(hn::Add(a, b), hn::Add(c, e))));
            }
            hn::Store(cost, d16, out + d);
        }
        std::fill(out + used, out + s.depth, kWorst);
    }
}

/// One pixel of a semi-global path: cost + the cheapest way on from the pixel before. Returns the
/// path's least cost.
HWY_INLINE U16 continuePath(const MatchJob& job, const Strip& s, const U16* cost, const U16* before,
                            U16 leastBefore, U16* path) {
    const D16 d16;
    const std::size_t n = hn::Lanes(d16);
    const auto small = hn::Set(d16, static_cast<U16>(job.penaltySmall));
    const auto base = hn::Set(d16, leastBefore);
    const auto jump = hn::SaturatedAdd(base, hn::Set(d16, static_cast<U16>(job.penaltyLarge)));
    auto least = hn::Set(d16, kWorst);
    for (std::size_t d = 0; d < s.depth; d += n) {
        const auto beside = hn::Min(hn::LoadU(d16, before + d - 1), hn::LoadU(d16, before + d + 1));
        const auto step = hn::Min(hn::Load(d16, before + d), hn::SaturatedAdd(beside, small));
        const auto way = hn::Sub(hn::Min(step, jump), base);
        const auto sum = hn::SaturatedAdd(hn::Load(d16, cost + d), way);
        hn::Store(sum, d16, path + d);
        least = hn::Min(least, sum);
    }
    return smallest(d16, least);
}

/// Semi-global pass along the row, both ways at once (two chains hide each other's latency).
/// cost := sum of both paths.
void smoothAlong(const MatchJob& job, const Strip& s) {
    const D16 d16;
    const std::size_t n = hn::Lanes(d16);
    const std::size_t last = s.width - 1;
    const auto column = [&](U16* row, std::size_t x) { return row + x * s.stride; };
    std::memcpy(column(s.pathRight, 0), column(s.cost, 0), s.depth * sizeof(U16));
    std::memcpy(column(s.pathLeft, last), column(s.cost, last), s.depth * sizeof(U16));
    const auto leastOf = [&](const U16* c) { return *std::min_element(c, c + s.depth); };
    U16 leastRight = leastOf(column(s.cost, 0));
    U16 leastLeft = leastOf(column(s.cost, last));
    for (std::size_t x = 1; x < s.width; ++x) {
        const std::size_t y = last - x;
        leastRight = continuePath(job, s, column(s.cost, x), column(s.pathRight, x - 1), leastRight,
                                  column(s.pathRight, x));
        leastLeft = continuePath(job, s, column(s.cost, y), column(s.pathLeft, y + 1), leastLeft,
                                 column(s.pathLeft, y));
    }
    for (std::size_t i = 0; i < s.width * s.stride; i += n) {
        hn::Store(hn::SaturatedAdd(hn::Load(d16, s.pathRight + i), hn::Load(d16, s.pathLeft + i)),
                  d16, s.cost + i);
    }
}

/// Lets `kGroup` neighbouring left pixels bid for the right pixels they see. Their ranges overlap;
/// together they touch each right pixel's record once.
template <std::size_t kGroup>
HWY_INLINE void bid(const Strip& s, std::size_t x) {
    const D16 d16;
    const std::size_t n = hn::Lanes(d16);
    const std::size_t start = s.width - 1 - (x + kGroup - 1);
    const std::size_t reach = kGroup > 1 ? s.depth + std::max(n, kGroup) : s.depth;
    for (std::size_t i = 0; i < reach; i += n) {
        auto best = hn::LoadU(d16, s.rightBest + start + i);
        auto index = hn::LoadU(d16, s.rightIndex + start + i);
        const auto iota = hn::Iota(d16, static_cast<U16>(i));
        for (std::size_t j = kGroup; j-- > 0;) {  // rising disparity: the lowest of equals stays
            const auto cost = hn::LoadU(d16, s.cost + (x + kGroup - 1 - j) * s.stride + i - j);
            index = hn::IfThenElse(hn::Lt(cost, best),
                                   hn::Sub(iota, hn::Set(d16, static_cast<U16>(j))), index);
            best = hn::Min(cost, best);
        }
        hn::StoreU(best, d16, s.rightBest + start + i);
        hn::StoreU(index, d16, s.rightIndex + start + i);
    }
}

/// The best match of each pixel of the right row among left pixels [from, to).
void searchRight(const Strip& s, std::size_t from, std::size_t to) {
    constexpr std::size_t kGroup = 8;
    std::size_t x = from;
    for (; x + kGroup <= to; x += kGroup) {
        bid<kGroup>(s, x);
    }
    for (; x < to; ++x) {
        bid<1>(s, x);
    }
}

/// Rival costs below this make a match ambiguous.
HWY_INLINE U16 rivalLimit(int ratio, int margin, U16 best) {
    const std::uint32_t limit = best + (best * static_cast<std::uint32_t>(ratio) >> 16U) +
                                static_cast<std::uint32_t>(margin) + 1;
    return static_cast<U16>(std::min<std::uint32_t>(kWorst, limit));
}

/// The best match of each left pixel in [from, to); `ratio` and `margin` as in MatchJob.
void searchLeft(const Strip& s, int ratio, int margin, const Minima& out, std::size_t from,
                std::size_t to) {
    const D16 d16;
    const std::size_t n = hn::Lanes(d16);
    for (std::size_t x = from; x < to; ++x) {
        const U16* cost = s.cost + x * s.stride;
        auto lanes = hn::Load(d16, cost);
        for (std::size_t d = n; d < s.depth; d += n) {
            lanes = hn::Min(lanes, hn::Load(d16, cost + d));
        }
        const U16 best = smallest(d16, lanes);
        const auto least = hn::Set(d16, best);
        std::size_t index = 0;
        for (std::size_t d = 0; d < s.depth; d += n) {
            const auto found = hn::FindFirstTrue(d16, hn::Eq(hn::Load(d16, cost + d), least));
            if (found >= 0) {
                index = d + static_cast<std::size_t>(found);
                break;
            }
        }
        bool ambiguous = false;
        if (margin >= 0) {
            // Lane minus (index - 1) wraps round: more than 2 means no neighbour of the minimum.
            const auto from1 = hn::Set(d16, static_cast<U16>(index - 1));
            const auto two = hn::Set(d16, U16{2});
            const auto limit = hn::Set(d16, rivalLimit(ratio, margin, best));
            for (std::size_t d = 0; d < s.depth; d += n) {
                const auto away = hn::Sub(hn::Iota(d16, static_cast<U16>(d)), from1);
                const auto rival =
                    hn::And(hn::Gt(away, two), hn::Lt(hn::Load(d16, cost + d), limit));
                ambiguous = ambiguous || !hn::AllFalse(d16, rival);
            }
        }
        out.best[x] = best;
        out.index[x] = static_cast<U16>(index);
        out.ambiguous[x] = ambiguous ? 1 : 0;
        out.before[x] = cost[static_cast<std::ptrdiff_t>(index) - 1];
        out.after[x] = cost[index + 1];
    }
}

/// The semi-global pass carries a match on along the row, also over surface that does not tell one
/// disparity from another: flat or periodic. Marks as ambiguous what lies farther than anchorReach
/// from every pixel whose window alone has the same minimum, every rival worse by anchorMargin.
void requireAnchors(const MatchJob& job, const Minima& own, const Minima& m) {
    const auto width = static_cast<std::size_t>(job.width);
    const auto reach = static_cast<std::size_t>(job.anchorReach);
    std::size_t covered = static_cast<std::size_t>(job.firstColumn);  // decided before this column
    for (std::size_t x = covered; x < width; ++x) {
        if (own.ambiguous[x] != 0 || std::abs(own.index[x] - m.index[x]) > 1) {
            continue;
        }
        for (; covered + reach < x; ++covered) {
            m.ambiguous[covered] = 1;
        }
        covered = std::max(covered, x + reach + 1);
    }
    for (; covered < width; ++covered) {
        m.ambiguous[covered] = 1;
    }
}

/// Minima of a row -> disparity and sigma.
void finishRow(const MatchJob& job, const Strip& s, const Minima& m, int row) {
    for (auto x = static_cast<std::size_t>(job.firstColumn); x < s.width; ++x) {
        m.partner[x] = s.rightIndex[s.width - 1 - x + m.index[x]];
    }
    const hn::CappedTag<float, 16> df;
    const hn::RebindToSigned<decltype(df)> di;
    const hn::Rebind<U16, decltype(df)> du;
    const std::size_t n = hn::Lanes(df);
    alignas(64) float disparity[16], sigma[16];
    const auto wide = [&](const U16* p) { return hn::PromoteTo(di, hn::LoadU(du, p)); };
    const auto i32 = [&](int v) { return hn::Set(di, v); };
    const auto f32 = [&](float v) { return hn::Set(df, v); };
    const std::size_t rowStart = static_cast<std::size_t>(row) * s.width;
    std::fill_n(job.disparity + rowStart, job.firstColumn, std::numeric_limits<float>::infinity());
    std::fill_n(job.sigma + rowStart, job.firstColumn, 0.0F);
    for (auto x = static_cast<std::size_t>(job.firstColumn); x < s.width; x += n) {
        const auto best = wide(m.best + x);
        const auto index = wide(m.index + x);
        const auto before = wide(m.before + x);
        const auto after = wide(m.after + x);
        const auto curvature = hn::Sub(hn::Add(before, after), hn::Add(best, best));
        // The true minimum may lie beyond the ends of the range.
        auto ok = hn::And(hn::Gt(index, i32(0)), hn::Lt(index, i32(job.numDisparities - 1)));
        ok = hn::And(ok, hn::Eq(wide(m.ambiguous + x), i32(0)));
        ok = hn::And(ok, hn::Gt(curvature, i32(job.minCurvature - 1)));
        if (job.leftRightCheck) {
            const auto apart = hn::Abs(hn::Sub(wide(m.partner + x), index));
            ok = hn::And(ok, hn::Lt(apart, i32(job.leftRightTolerance + 1)));
        }
        const auto where = hn::Sub(hn::Iota(di, static_cast<int>(x) - job.minDisparity), index);
        ok = hn::And(ok, hn::And(hn::Gt(where, i32(-1)), hn::Lt(where, i32(job.width))));

        const auto sharp = hn::ConvertTo(df, hn::Max(curvature, i32(1)));
        auto d = hn::ConvertTo(df, hn::Add(index, i32(job.minDisparity)));
        if (job.subpixel) {
            const auto slope = hn::ConvertTo(df, hn::Sub(before, after));
            d = hn::Add(d, hn::Div(hn::Mul(slope, f32(0.5F)), sharp));
        }
        const auto cost = hn::ConvertTo(df, best);
        const auto& model = job.sigmaModel;
        const auto excess =
            hn::Max(f32(0), hn::Sub(hn::Mul(cost, cost), f32(model.explained * model.explained)));
        const auto spread = hn::Add(f32(model.noise * model.noise),
                                    hn::Mul(f32(model.mismatch * model.mismatch), excess));
        const auto variance =
            hn::Add(f32(model.floor * model.floor), hn::Div(spread, hn::Mul(sharp, sharp)));
        const auto valid = hn::RebindMask(df, ok);
        hn::Store(hn::IfThenElse(valid, d, f32(std::numeric_limits<float>::infinity())), df,
                  disparity);
        hn::Store(hn::IfThenElse(valid, hn::Sqrt(variance), f32(0)), df, sigma);
        const std::size_t bytes = std::min(n, s.width - x) * sizeof(float);
        std::memcpy(job.disparity + rowStart + x, disparity, bytes);
        std::memcpy(job.sigma + rowStart + x, sigma, bytes);
    }
}

void searchRow(const MatchJob& job, const Strip& s, int row) {
    const Minima minima(s, s.best);
    const auto first = static_cast<std::size_t>(job.firstColumn);
    std::fill(s.rightBest, s.rightBest + s.width + s.stride, kWorst);
    std::fill(s.rightIndex, s.rightIndex + s.width + s.stride, kWorst);
    if (job.penaltyLarge > 0) {
        combineWindows(job, s, row, 0, s.width);
        const Minima own(s, s.ownBest);
        searchLeft(s, 0, job.anchorMargin, own, first, s.width);
        smoothAlong(job, s);
        searchRight(s, 0, s.width);
        searchLeft(s, job.uniquenessRatio, job.uniquenessMargin, minima, first, s.width);
        requireAnchors(job, own, minima);
    } else {
        // A few columns at a time, so that their costs are still in the first-level cache.
        const std::size_t step = std::max<std::size_t>(8, 8192 / s.stride / 8 * 8);
        for (std::size_t x = 0; x < s.width; x += step) {
            const std::size_t end = std::min(s.width, x + step);
            combineWindows(job, s, row, x, end);
            searchRight(s, x, end);
            searchLeft(s, job.uniquenessRatio, job.uniquenessMargin, minima, std::max(x, first),
                       end);
        }
    }
    finishRow(job, s, minima, row);
}

void matchRows(const MatchJob& job, int first, int last, U16* scratch) {
    const Strip s(job, scratch);
    std::fill(s.cost - kLanes, s.rightBest, kWorst);
    std::fill(s.columns, s.columns + (s.width + 2 * s.pad) * s.depth, U16{0});
    int next = std::max(0, first - job.supportOffset);  // the next row of window sums
    for (int r = next - job.halfWindow; r < next + job.halfWindow; ++r) {
        slideDown(job, s, r, r, false);
    }
    bool fresh = true;  // the first window has no row above it to leave
    for (int row = first; row < last; ++row) {
        for (; next <= clampRow(job, row + job.supportOffset); ++next) {
            slideDown(job, s, next + job.halfWindow, next - job.halfWindow - 1, !fresh);
            fresh = false;
            slideAlong(s, s.windowRow(next));
        }
        searchRow(job, s, row);
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
constexpr int kWide[] = {4, 14, 31, 50, 58, 50, 31, 14, 4};  // sigma 1.75 px, sum 256
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
    const auto stride = depth + kLanes;
    const auto offset = static_cast<std::size_t>(job.supportOffset);
    const auto pad = static_cast<std::size_t>(job.halfWindow);
    const std::size_t windows =
        (width + 2 * pad) * depth + (2 * offset + 1) * (width + 2 * offset) * depth;
    return windows + 3 * (kLanes + width * stride) + 2 * (width + stride) +
           2 * 6 * (width + kLanes);
}

void matchRows(const MatchJob& job, int first, int last, std::uint16_t* scratch) {
    HWY_DYNAMIC_DISPATCH(matchRows)(job, first, last, scratch);
}

void prefilterRows(Filter filter, int gain, int cap, const std::uint8_t* image, std::size_t stride,
                   int width, int height, int first, int last, std::uint16_t* scratch,
                   std::uint8_t* out) {
    HWY_DYNAMIC_DISPATCH(prefilterRows)
    (filter, gain, cap, image, stride, width, height, first, last, scratch, out);
}

void reverseRight(const std::uint8_t* row, int width, int minDisparity, std::size_t n,
                  std::uint8_t* out) {
    // Position i shows column start - i: beyond the last column, in the row, before the first.
    const int start = width - 1 - minDisparity;
    const auto count = static_cast<int>(n);
    const int inside = std::clamp(start - (width - 1), 0, count);
    const int before = std::clamp(start + 1, inside, count);
    std::fill(out, out + inside, row[width - 1]);
    if (before > inside) {
        std::reverse_copy(row + (start - before + 1), row + (start - inside + 1), out + inside);
    }
    std::fill(out + before, out + count, row[0]);
}

}  // namespace riftmap::kernel
#endif
