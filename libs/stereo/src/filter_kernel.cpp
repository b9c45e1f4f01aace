// SPDX-License-Identifier: BSD-3-Clause
#include "filter_kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "filter_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace riftmap::kernel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::ScalableTag<float>;
using One = hn::CappedTag<float, 1>;

constexpr float kNone = std::numeric_limits<float>::infinity();

/// Calls body(tag, i) for [first, last): whole vectors, then lane by lane.
template <class Body>
HWY_INLINE void along(std::size_t first, std::size_t last, const Body& body) {
    const Lanes wide;
    std::size_t i = first;
    for (; i + hn::Lanes(wide) <= last; i += hn::Lanes(wide)) {
        body(wide, i);
    }
    for (; i < last; ++i) {
        body(One(), i);
    }
}

std::size_t findEnds(const float* d, std::size_t width, float maxDifference, std::int32_t* ends) {
    std::size_t count = 0;
    if (width > 0 && d[0] < kNone) {
        ends[count++] = 0;
    }
    along(1, width, [&](auto tag, std::size_t i) {
        const hn::RebindToSigned<decltype(tag)> columns;
        const auto here = hn::LoadU(tag, d + i);
        const auto before = hn::LoadU(tag, d + i - 1);
        // Not a number, from two infinities, compares false.
        const auto apart = hn::Gt(hn::Abs(hn::Sub(here, before)), hn::Set(tag, maxDifference));
        count += hn::CompressStore(hn::Iota(columns, static_cast<std::int32_t>(i)),
                                   hn::RebindMask(columns, apart), columns, ends + count);
    });
    return count;
}

void leastAlong(const float* d, std::size_t width, std::size_t reach, float* out) {
    const std::size_t inner = std::min(reach, width);
    const std::size_t end = width > reach ? std::max(inner, width - reach) : inner;
    along(inner, end, [&](auto tag, std::size_t i) {
        auto least = hn::LoadU(tag, d + i);
        for (std::size_t k = 1; k <= reach; ++k) {
            least = hn::Min(least, hn::Min(hn::LoadU(tag, d + i - k), hn::LoadU(tag, d + i + k)));
        }
        hn::StoreU(least, tag, out + i);
    });
    const auto border = [&](std::size_t i) {
        const std::size_t first = i - std::min(i, reach);
        out[i] = *std::min_element(d + first, d + std::min(width, i + reach + 1));
    };
    for (std::size_t i = 0; i < inner; ++i) {
        border(i);
    }
    for (std::size_t i = end; i < width; ++i) {
        border(i);
    }
}

void discardAbove(const float* const* rows, std::size_t count, std::size_t width, float step,
                  float* d) {
    along(0, width, [&](auto tag, std::size_t i) {
        auto least = hn::LoadU(tag, rows[0] + i);
        for (std::size_t k = 1; k < count; ++k) {
            least = hn::Min(least, hn::LoadU(tag, rows[k] + i));
        }
        const auto here = hn::LoadU(tag, d + i);
        const auto above = hn::Gt(hn::Sub(here, least), hn::Set(tag, step));
        hn::StoreU(hn::IfThenElse(above, hn::Set(tag, kNone), here), tag, d + i);
    });
}

void growSigma(const float* d, const float* up, const float* down, std::size_t width, float slope,
               float* sigma) {
    const float perPixel = slope / static_cast<float>(kSlopeReach);
    const auto grow = [&](auto tag, std::size_t i, const float* left, const float* right) {
        const auto here = hn::LoadU(tag, d + i);
        const auto none = hn::Set(tag, kNone);
        auto steepest = hn::Zero(tag);
        for (const float* side : {up + i, down + i, left, right}) {
            const auto there = hn::LoadU(tag, side);
            const auto change = hn::Abs(hn::Sub(there, here));
            steepest = hn::Max(steepest, hn::IfThenElseZero(hn::Lt(there, none), change));
        }
        const auto own = hn::LoadU(tag, sigma + i);
        const auto more = hn::Mul(steepest, hn::Set(tag, perPixel));
        const auto grown = hn::Sqrt(hn::Add(hn::Mul(own, own), hn::Mul(more, more)));
        hn::StoreU(hn::IfThenElse(hn::Lt(here, none), grown, own), tag, sigma + i);
    };
    const std::size_t inner = std::min(kSlopeReach, width);
    const std::size_t end = width > kSlopeReach ? std::max(inner, width - kSlopeReach) : inner;
    along(inner, end,
          [&](auto tag, std::size_t i) { grow(tag, i, d + i - kSlopeReach, d + i + kSlopeReach); });
    const auto border = [&](std::size_t i) {
        grow(One(), i, i >= kSlopeReach ? d + i - kSlopeReach : d + i,
             i + kSlopeReach < width ? d + i + kSlopeReach : d + i);
    };
    for (std::size_t i = 0; i < inner; ++i) {
        border(i);
    }
    for (std::size_t i = end; i < width; ++i) {
        border(i);
    }
}

std::int32_t roughness(const std::uint8_t* first, std::size_t stride) {
    const hn::CappedTag<std::int16_t, kNoiseBlock> i16;
    const hn::Rebind<std::uint8_t, decltype(i16)> u8;
    const std::size_t n = hn::Lanes(i16);
    std::int32_t total = 0;
    for (std::size_t x = 0; x < kNoiseBlock; x += n) {
        auto sum = hn::Zero(i16);  // eight answers of 2040 at most fit
        auto lowest = hn::Set(i16, 255), highest = hn::Zero(i16);
        const auto load = [&](const std::uint8_t* at) {
            return hn::PromoteTo(i16, hn::LoadU(u8, at));
        };
        const auto across = [&](std::size_t row) {
            const std::uint8_t* at = first + x + row * stride - stride;
            const auto middle = load(at);
            if (row > 0 && row <= kNoiseBlock) {
                lowest = hn::Min(lowest, middle);
                highest = hn::Max(highest, middle);
            }
            return hn::Sub(hn::Add(load(at - 1), load(at + 1)), hn::Add(middle, middle));
        };
        auto above = across(0);
        auto here = across(1);
        for (std::size_t row = 2; row < kNoiseBlock + 2; ++row) {
            const auto below = across(row);
            sum = hn::Add(sum, hn::Abs(hn::Sub(hn::Add(above, below), hn::Add(here, here))));
            above = here;
            here = below;
        }
        const auto outside =
            hn::Or(hn::Lt(lowest, hn::Set(i16, 8)), hn::Gt(highest, hn::Set(i16, 247)));
        if (!hn::AllFalse(i16, outside)) {
            return -1;
        }
        std::int16_t lanes[kNoiseBlock];
        hn::StoreU(sum, i16, lanes);
        for (std::size_t i = 0; i < n; ++i) {
            total += lanes[i];
        }
    }
    return total;
}

void planeMiddles(const float* const* rows, int count, int first, std::size_t width, float most,
                  float* out) {
    along(0, width, [&](auto tag, std::size_t i) {
        const auto set = [&](int x) { return hn::Set(tag, static_cast<float>(x)); };
        const auto zero = hn::Zero(tag);
        const auto here = hn::LoadU(tag, rows[-first] + i + kPlaneReach);
        // Sums over the points (u, v) that lie r beyond the pixel's own disparity.
        auto n = zero, su = zero, sv = zero, suu = zero, suv = zero, svv = zero;
        auto sr = zero, sur = zero, svr = zero;
        for (int k = 0; k < count; ++k) {
            auto rowN = zero, rowU = zero, rowUU = zero, rowR = zero, rowUR = zero;
            for (int u = -kPlaneReach; u <= kPlaneReach; ++u) {
                const auto there =
                    hn::LoadU(tag, rows[k] + i + static_cast<std::size_t>(u + kPlaneReach));
                const auto beyond = hn::Sub(there, here);
                // Not a number, from two infinities, compares false.
                const auto counts = hn::Le(hn::Abs(beyond), hn::Set(tag, most));
                const auto one = hn::IfThenElseZero(counts, set(1));
                const auto r = hn::IfThenElseZero(counts, beyond);
                rowN = hn::Add(rowN, one);
                rowU = hn::Add(rowU, hn::Mul(set(u), one));
                rowUU = hn::Add(rowUU, hn::Mul(set(u * u), one));
                rowR = hn::Add(rowR, r);
                rowUR = hn::Add(rowUR, hn::Mul(set(u), r));
            }
            const int v = first + k;
            n = hn::Add(n, rowN);
            su = hn::Add(su, rowU);
            sv = hn::Add(sv, hn::Mul(set(v), rowN));
            suu = hn::Add(suu, rowUU);
            suv = hn::Add(suv, hn::Mul(set(v), rowU));
            svv = hn::Add(svv, hn::Mul(set(v * v), rowN));
            sr = hn::Add(sr, rowR);
            sur = hn::Add(sur, rowUR);
            svr = hn::Add(svr, hn::Mul(set(v), rowR));
        }
        // Cramer's rule. The determinant is of whole numbers small enough to be exact: 0, or 1 and
        // more.
        const auto minus = [&](auto a, auto b, auto c, auto d) {
            return hn::Sub(hn::Mul(a, b), hn::Mul(c, d));
        };
        const auto a = minus(suu, svv, suv, suv);
        const auto b = minus(sv, suv, su, svv);
        const auto c = minus(su, suv, sv, suu);
        const auto times = [&](auto x, auto y, auto z) {
            return hn::Add(hn::Add(hn::Mul(x, a), hn::Mul(y, b)), hn::Mul(z, c));
        };
        const auto determinant = times(n, su, sv);
        const auto plane = hn::And(hn::Ge(n, set(6)), hn::Gt(determinant, hn::Set(tag, 0.5F)));
        const auto middle = hn::Div(times(sr, sur, svr), determinant);
        hn::StoreU(hn::Add(here, hn::IfThenElseZero(plane, middle)), tag, out + i);
    });
}

void moveRow(const ComparedRow* rows, int count, int own, std::size_t width, const float* matched,
             float least, float most, float* scratch, float* d, float* sigma) {
    constexpr float kMostMove = 0.5F;      // [px]
    constexpr float kRounding = 1.0F / 6;  // variance of the difference of two rounded samples
    constexpr float kLeastPixels = 10;
    const std::size_t stride = width + kPlaneRoom;
    along(0, width, [&](auto tag, std::size_t i) {
        auto n = hn::Zero(tag);
        auto g = n, e = n, gg = n, ge = n, ee = n;
        for (int k = 0; k < count; ++k) {
            const auto gradient = hn::LoadU(tag, rows[k].gradient + i);
            const auto difference = hn::LoadU(tag, rows[k].difference + i);
            n = hn::Add(n, hn::LoadU(tag, rows[k].compared + i));
            g = hn::Add(g, gradient);
            e = hn::Add(e, difference);
            gg = hn::Add(gg, hn::Mul(gradient, gradient));
            ge = hn::Add(ge, hn::Mul(gradient, difference));
            ee = hn::Add(ee, hn::Mul(difference, difference));
        }
        float* const to = scratch + i + kPlaneReach;
        hn::StoreU(n, tag, to);
        hn::StoreU(g, tag, to + stride);
        hn::StoreU(e, tag, to + 2 * stride);
        hn::StoreU(gg, tag, to + 3 * stride);
        hn::StoreU(ge, tag, to + 4 * stride);
        hn::StoreU(ee, tag, to + 5 * stride);
    });
    along(0, width, [&](auto tag, std::size_t i) {
        const auto set = [&](float x) { return hn::Set(tag, x); };
        const auto window = [&](std::size_t k) {
            auto sum = hn::Zero(tag);
            for (std::size_t u = 0; u <= kPlaneRoom; ++u) {
                sum = hn::Add(sum, hn::LoadU(tag, scratch + k * stride + i + u));
            }
            return sum;
        };
        const auto n = window(0), g = window(1), e = window(2);
        const auto compared = hn::LoadU(tag, rows[own].compared + i);
        const auto moves = hn::And(hn::Gt(compared, set(0)), hn::Ge(n, set(kLeastPixels)));
        // Without the means; var(g) at least so much that it divides.
        const auto without = [&](auto sum, auto a, auto b) {
            return hn::Sub(sum, hn::Div(hn::Mul(a, b), n));
        };
        const auto gg = hn::Max(without(window(3), g, g), set(1e-3F));
        const auto ge = without(window(4), g, e);
        const auto ee = without(window(5), e, e);
        const auto rest = hn::Max(
            hn::Div(hn::Sub(ee, hn::Div(hn::Mul(ge, ge), gg)), hn::Sub(n, set(2))), set(kRounding));
        const auto ofMatcher = hn::LoadU(tag, matched + i);
        const auto prior = hn::Mul(ofMatcher, ofMatcher);
        const auto by = hn::Clamp(hn::Div(hn::Neg(ge), hn::Add(gg, hn::Div(rest, prior))),
                                  set(-kMostMove), set(kMostMove));
        const auto here = hn::LoadU(tag, d + i);
        const auto there = hn::Clamp(hn::Add(here, by), set(least), set(most));
        hn::StoreU(hn::IfThenElse(moves, there, here), tag, d + i);
        const auto inverse = hn::Add(hn::Div(set(1), prior), hn::Div(gg, rest));
        const auto stays = hn::Mul(prior, hn::Add(set(0.2F), hn::Mul(set(0.4F), prior)));
        const auto left = hn::Sqrt(hn::Add(hn::Div(set(1), inverse), stays));
        hn::StoreU(hn::IfThenElse(moves, left, hn::LoadU(tag, sigma + i)), tag, sigma + i);
    });
}

}  // namespace HWY_NAMESPACE
}  // namespace riftmap::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap::kernel {

HWY_EXPORT(findEnds);
HWY_EXPORT(leastAlong);
HWY_EXPORT(discardAbove);
HWY_EXPORT(growSigma);
HWY_EXPORT(roughness);
HWY_EXPORT(planeMiddles);
HWY_EXPORT(moveRow);

std::size_t findEnds(const float* d, std::size_t width, float maxDifference, std::int32_t* ends) {
    return HWY_DYNAMIC_DISPATCH(findEnds)(d, width, maxDifference, ends);
}

void leastAlong(const float* d, std::size_t width, std::size_t reach, float* out) {
    HWY_DYNAMIC_DISPATCH(leastAlong)(d, width, reach, out);
}

void discardAbove(const float* const* rows, std::size_t count, std::size_t width, float step,
                  float* d) {
    HWY_DYNAMIC_DISPATCH(discardAbove)(rows, count, width, step, d);
}

void growSigma(const float* d, const float* up, const float* down, std::size_t width, float slope,
               float* sigma) {
    HWY_DYNAMIC_DISPATCH(growSigma)(d, up, down, width, slope, sigma);
}

void planeMiddles(const float* const* rows, int count, int first, std::size_t width, float most,
                  float* out) {
    HWY_DYNAMIC_DISPATCH(planeMiddles)(rows, count, first, width, most, out);
}

void moveRow(const ComparedRow* rows, int count, int own, std::size_t width, const float* matched,
             float least, float most, float* scratch, float* d, float* sigma) {
    HWY_DYNAMIC_DISPATCH(moveRow)
    (rows, count, own, width, matched, least, most, scratch, d, sigma);
}

std::int32_t roughness(const std::uint8_t* first, std::size_t stride) {
    return HWY_DYNAMIC_DISPATCH(roughness)(first, stride);
}

}  // namespace riftmap::kernel
#endif
