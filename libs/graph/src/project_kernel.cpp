// SPDX-License-Identifier: BSD-3-Clause
#include "project_kernel.h"

#include <algorithm>
#include <limits>

#include "match_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "project_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "slot_bits-inl.h"
#include "vector_tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
using DI = hn::Rebind<std::int32_t, D>;
using DU = hn::Rebind<std::uint32_t, D>;
using D16 = hn::Rebind<std::uint16_t, D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
constexpr D d;
constexpr DI di;
constexpr DU du;

HWY_INLINE V set(float x) {
    return hn::Set(d, x);
}

/// compact::Sigma::decode
HWY_INLINE V sigmaOf(const std::uint16_t* codes) {
    using Sigma = compact::Sigma;
    const VI code = hn::PromoteTo(di, hn::LoadU(D16(), codes));
    const VI bits = hn::ShiftLeft<Sigma::kShift>(hn::Add(code, hn::Set(di, Sigma::kBias)));
    return hn::IfThenZeroElse(hn::RebindMask(d, hn::Eq(code, hn::Zero(di))), hn::BitCast(d, bits));
}

/// compact::roundNearest
HWY_INLINE VI rounded(V x) {
    return hn::Sub(hn::ConvertTo(di, hn::Add(x, set(4096.5F))), hn::Set(di, 4096));
}

void projectOf(const Page& page, const Projection& in, ProjectedPage& out) {
    const auto& r = in.rotation;
    const V right = set(static_cast<float>(in.width) - 0.5F + in.border);
    const V bottom = set(static_cast<float>(in.height) - 0.5F + in.border);
    const V before = set(-0.5F - in.border);
    constexpr std::uint32_t kAll = Page::kSize;
    const auto step = static_cast<std::uint32_t>(hn::Lanes(d));
    VI first = hn::Set(di, std::numeric_limits<std::int32_t>::max()), last = hn::Set(di, -1);
    out.inView = 0;
    for (std::uint32_t slot = 0; slot < kAll; slot += step) {
        const auto bits = static_cast<std::uint32_t>((page.alive >> slot) & 0xFFFFU);
        if (bits == 0) {
            hn::StoreU(hn::Zero(d), d, out.z + slot);
            continue;
        }
        const auto alive = hn::RebindMask(
            d, hn::TestBit(hn::Set(du, bits), hn::Shl(hn::Set(du, 1U), hn::Iota(du, 0U))));
        const V dx = hn::Sub(hn::LoadU(d, page.x.data() + slot), set(in.translation[0]));
        const V dy = hn::Sub(hn::LoadU(d, page.y.data() + slot), set(in.translation[1]));
        const V dz = hn::Sub(hn::LoadU(d, page.z.data() + slot), set(in.translation[2]));
        const auto along = [&](std::size_t axis) {
            return hn::Add(
                hn::Add(hn::Mul(set(r[3 * axis]), dx), hn::Mul(set(r[3 * axis + 1]), dy)),
                hn::Mul(set(r[3 * axis + 2]), dz));
        };
        const V z = along(2);
        const V u = hn::Add(hn::Div(hn::Mul(set(in.fx), along(0)), z), set(in.cx));
        const V v = hn::Add(hn::Div(hn::Mul(set(in.fy), along(1)), z), set(in.cy));
        auto seen = hn::And(alive, hn::Ge(z, set(in.nearest)));
        seen = hn::And(seen, hn::And(hn::Ge(u, before), hn::Lt(u, right)));
        seen = hn::And(seen, hn::And(hn::Ge(v, before), hn::Lt(v, bottom)));
        const VI zero = hn::Zero(di);
        const VI column = hn::Min(hn::Max(rounded(u), zero), hn::Set(di, in.width - 1));
        const VI row = hn::Min(hn::Max(rounded(v), zero), hn::Set(di, in.height - 1));
        const VI tile = hn::Add(hn::Mul(hn::ShiftRight<3>(row), hn::Set(di, in.tileColumns)),
                                hn::ShiftRight<3>(column));
        const V sigma = sigmaOf(page.sigma.data() + slot);
        // What lies farther is hidden behind everything the view shows there.
        const V farthest =
            hn::Add(hn::GatherIndex(d, in.reach, tile), hn::Mul(set(in.noiseGate), sigma));
        seen = hn::And(seen, hn::Le(z, farthest));
        hn::StoreU(u, d, out.u + slot);
        hn::StoreU(v, d, out.v + slot);
        hn::StoreU(hn::IfThenElseZero(seen, z), d, out.z + slot);
        hn::StoreU(sigma, d, out.sigma + slot);
        const VI pixel = hn::Add(hn::Mul(row, hn::Set(di, in.width)), column);
        hn::StoreU(hn::BitCast(du, pixel), du, out.pixel + slot);
        const auto seenInt = hn::RebindMask(di, seen);
        first = hn::IfThenElse(seenInt, hn::Min(first, row), first);
        last = hn::IfThenElse(seenInt, hn::Max(last, row), last);
        out.inView |= slotBits(d, seen, slot);
    }
    out.firstRow = hn::GetLane(hn::MinOfLanes(di, first));
    out.lastRow = hn::GetLane(hn::MaxOfLanes(di, last));
}

void reachOf(const ReachRow& in, float* most) {
    const auto step = static_cast<int>(hn::Lanes(d));
    for (int c = 0; c < in.width; c += step) {
        const int left = in.width - c;
        const V z = loadSome(d, in.z + c, left);
        V gate = set(in.gamma);
        if (!in.gammaOnly) {  // gateOf
            const V blur = hn::Mul(set(kBlur), hn::Mul(z, set(in.footprint)));
            const V stretch = hn::Max(set(1.0F), loadSome(d, in.stretch + c, left));
            const V noise = hn::Mul(set(kNoiseGate), loadSome(d, in.sigma + c, left));
            gate = hn::Max(gate, hn::Max(noise, hn::Mul(blur, stretch)));
        }
        const V reach = hn::IfThenElseZero(hn::Gt(z, hn::Zero(d)), hn::Add(z, gate));
        storeSome(hn::Max(reach, loadSome(d, most + c, left)), d, most + c, left);
    }
}

}  // namespace
}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap {

HWY_EXPORT(projectOf);
HWY_EXPORT(reachOf);

void projectPage(const Page& page, const Projection& view, ProjectedPage& out) {
    HWY_DYNAMIC_DISPATCH(projectOf)(page, view, out);
}
void reachOfRow(const ReachRow& row, float* most) {
    HWY_DYNAMIC_DISPATCH(reachOf)(row, most);
}

}  // namespace riftmap
#endif
