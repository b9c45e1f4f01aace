// SPDX-License-Identifier: BSD-3-Clause
#include "edge_kernel.h"

#include <algorithm>

#include "view_points.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "edge_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using DU = hn::CappedTag<std::uint32_t, 16>;
using D16 = hn::Rebind<std::uint16_t, DU>;
using D8 = hn::Rebind<std::uint8_t, DU>;
constexpr DU du;

std::size_t listOf(const EdgeSpan& in, const EdgeList& out) {
    std::size_t n = 0;
    const auto none = hn::Set(du, std::uint32_t{ViewPoints::kNoEdge});
    const auto noVertex = hn::Set(du, kNoVertex);
    for (std::size_t i = 0; i < in.count; i += hn::Lanes(du)) {
        const auto from = hn::LoadU(du, in.vertex + i);
        const auto fresh = hn::LoadU(D8(), in.fresh + i);
        const auto end = [&](const std::uint16_t* codes, std::size_t ahead, auto& weight) {
            const auto to = hn::LoadU(du, in.vertex + i + ahead);
            weight = hn::PromoteTo(du, hn::LoadU(D16(), codes + i));
            const auto both =
                hn::PromoteTo(du, hn::And(fresh, hn::LoadU(D8(), in.fresh + i + ahead)));
            const auto concerned = hn::And(hn::And(hn::Ne(weight, none), hn::Ne(from, to)),
                                           hn::Eq(both, hn::Zero(du)));
            return hn::IfThenElse(concerned, to, noVertex);
        };
        auto rightCode = none, downCode = none;
        const auto right = end(in.right, 1, rightCode);
        const auto down = end(in.down, in.width, downCode);
        const auto some = hn::And(hn::Or(hn::Ne(right, noVertex), hn::Ne(down, noVertex)),
                                  hn::FirstN(du, in.count - i));
        hn::CompressStore(from, some, du, out.from + n);
        hn::CompressStore(right, some, du, out.right + n);
        hn::CompressStore(down, some, du, out.down + n);
        n += hn::CompressStore(hn::Or(rightCode, hn::ShiftLeft<16>(downCode)), some, du,
                               out.codes + n);
    }
    return n;
}

}  // namespace
}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap {

HWY_EXPORT(listOf);

std::size_t listEdges(const EdgeSpan& span, const EdgeList& list) {
    return HWY_DYNAMIC_DISPATCH(listOf)(span, list);
}

}  // namespace riftmap
#endif
