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

std::size_t listOf(const EdgeSpan& in, VertexId* a, VertexId* b, std::uint32_t* code) {
    std::size_t n = 0;
    const auto none = hn::Set(du, std::uint32_t{ViewPoints::kNoEdge});
    for (std::size_t i = 0; i < in.count; i += hn::Lanes(du)) {
        const auto from = hn::LoadU(du, in.vertex + i);
        const auto to = hn::LoadU(du, in.vertex + i + in.ahead);
        const auto weight = hn::PromoteTo(du, hn::LoadU(D16(), in.code + i));
        const auto fresh = hn::PromoteTo(
            du, hn::And(hn::LoadU(D8(), in.fresh + i), hn::LoadU(D8(), in.fresh + i + in.ahead)));
        const auto concerned =
            hn::And(hn::And(hn::Ne(weight, none), hn::Ne(from, to)),
                    hn::And(hn::Eq(fresh, hn::Zero(du)), hn::FirstN(du, in.count - i)));
        hn::CompressStore(from, concerned, du, a + n);
        hn::CompressStore(to, concerned, du, b + n);
        n += hn::CompressStore(weight, concerned, du, code + n);
    }
    return n;
}

}  // namespace
}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap {

HWY_EXPORT(listOf);

std::size_t listEdges(const EdgeSpan& span, VertexId* a, VertexId* b, std::uint32_t* code) {
    return HWY_DYNAMIC_DISPATCH(listOf)(span, a, b, code);
}

}  // namespace riftmap
#endif
