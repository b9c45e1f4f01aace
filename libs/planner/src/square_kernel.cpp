// SPDX-License-Identifier: BSD-3-Clause
#include "square_kernel.h"

#include <algorithm>
#include <bit>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "square_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
constexpr D d;
constexpr DI di;

/// The nearest pixel, counted from 1; 0 for all that lie before the first.
HWY_INLINE VI nearestPixel(V x) {
    const V some = hn::Min(hn::Max(x, hn::Set(d, -1.0F)), hn::Set(d, 1e6F));
    return hn::ConvertTo(di, hn::Add(some, hn::Set(d, 1.5F)));
}

void drawOf(const SquareCamera& c, const SquareBatch& batch, float* depth) {
    constexpr std::size_t kMost = SquareBatch::kMost;
    alignas(64) std::array<float, kMost> z{};
    alignas(64) std::array<std::int32_t, kMost> left{}, right{}, top{}, bottom{};
    std::array<std::uint64_t, kMost / 64> inImage{};
    const std::size_t step = hn::Lanes(d);
    for (std::size_t i = 0; i < batch.count; i += step) {
        const V x = hn::Load(d, &batch.x[i]);
        const V y = hn::Load(d, &batch.y[i]);
        const V w = hn::Load(d, &batch.z[i]);
        // In the order in which Eigen multiplies a matrix with a vector, and without fused
        // operations (-ffp-contract=off), for the same bits.
        const auto along = [&](int axis) {
            const auto times = [&](int k, V v) {
                return hn::Mul(hn::Set(d, c.rotation(axis, k)), v);
            };
            return hn::Add(hn::Add(times(0, x), hn::Add(times(1, y), times(2, w))),
                           hn::Set(d, c.translation[axis]));
        };
        const V away = along(2);
        const V divisor = hn::Max(away, hn::Set(d, c.nearest));
        const V u =
            hn::Add(hn::Div(hn::Mul(hn::Set(d, c.fx), along(0)), divisor), hn::Set(d, c.cx));
        const V v =
            hn::Add(hn::Div(hn::Mul(hn::Set(d, c.fy), along(1)), divisor), hn::Set(d, c.cy));
        const V r = hn::Div(hn::Set(d, c.fx * c.half), divisor);
        const VI first = hn::Set(di, 1);
        const VI l = hn::Max(nearestPixel(hn::Sub(u, r)), first);
        const VI t = hn::Max(nearestPixel(hn::Sub(v, r)), first);
        const VI ri = hn::Min(nearestPixel(hn::Add(u, r)), hn::Set(di, c.width));
        const VI b = hn::Min(nearestPixel(hn::Add(v, r)), hn::Set(di, c.height));
        const auto inRange =
            hn::And(hn::Ge(away, hn::Set(d, c.nearest)), hn::Le(away, hn::Set(d, c.farthest)));
        const auto none = hn::RebindMask(d, hn::Or(hn::Gt(l, ri), hn::Gt(t, b)));
        const auto drawn = hn::And(hn::FirstN(d, batch.count - i), hn::AndNot(none, inRange));
        hn::Store(away, d, &z[i]);
        hn::Store(l, di, &left[i]);
        hn::Store(ri, di, &right[i]);
        hn::Store(t, di, &top[i]);
        hn::Store(b, di, &bottom[i]);
        std::array<std::uint8_t, 8> bits{};  // as slotBits() of the graph does
        hn::StoreMaskBits(d, drawn, bits.data());
        inImage[i / 64] |= std::uint64_t{unsigned{bits[0]} | (unsigned{bits[1]} << 8U)} << (i % 64);
    }
    for (std::size_t begin = 0; begin < batch.count; begin += 64) {
        for (std::uint64_t rest = inImage[begin / 64]; rest != 0; rest &= rest - 1) {
            const std::size_t i = begin + static_cast<std::size_t>(std::countr_zero(rest));
            for (int row = top[i]; row <= bottom[i]; ++row) {
                float* line = depth + static_cast<std::ptrdiff_t>(row - 1) * c.width;
                for (int column = left[i]; column <= right[i]; ++column) {
                    // In this form without a branch, which nobody could foretell.
                    const float old = line[column - 1];
                    line[column - 1] = z[i] < old ? z[i] : old;
                }
            }
        }
    }
}

}  // namespace
}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap {

HWY_EXPORT(drawOf);

void drawSquares(const SquareCamera& camera, const SquareBatch& batch, float* depth) {
    HWY_DYNAMIC_DISPATCH(drawOf)(camera, batch, depth);
}

}  // namespace riftmap
#endif
