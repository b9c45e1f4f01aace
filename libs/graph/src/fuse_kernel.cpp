// SPDX-License-Identifier: BSD-3-Clause
#include "fuse_kernel.h"

#include <cstddef>
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fuse_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

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
using VU = hn::Vec<DU>;
using M = hn::Mask<D>;
constexpr D d;
constexpr DI di;
constexpr DU du;
constexpr D16 d16;

HWY_INLINE V set(float x) {
    return hn::Set(d, x);
}
HWY_INLINE M slotMask(std::uint64_t slots, std::uint32_t first) {
    const auto bits = static_cast<std::uint32_t>((slots >> first) & 0xFFFFU);
    return hn::RebindMask(
        d, hn::TestBit(hn::Set(du, bits), hn::Shl(hn::Set(du, 1U), hn::Iota(du, 0U))));
}
HWY_INLINE std::uint64_t slotBits(M mask, std::uint32_t first) {
    std::array<std::uint8_t, 8> bytes{};
    hn::StoreMaskBits(d, mask, bytes.data());
    return std::uint64_t{unsigned{bytes[0]} | (unsigned{bytes[1]} << 8U)} << first;
}

/// A direction a lane.
struct Directions {
    V x, y, z;
};

HWY_INLINE Directions normalised(const Directions& n) {
    const V squared = hn::Add(hn::Mul(n.x, n.x), hn::Add(hn::Mul(n.y, n.y), hn::Mul(n.z, n.z)));
    const V length = hn::Sqrt(squared);
    return {hn::Div(n.x, length), hn::Div(n.y, length), hn::Div(n.z, length)};
}

/// 1 with the sign of x; 1 for -0.
HWY_INLINE V signOf(V x) {
    return hn::IfThenElse(hn::Lt(x, hn::Zero(d)), set(-1.0F), set(1.0F));
}

/// compact::decodeDirection
HWY_INLINE Directions decodeDirections(VU code) {
    const auto part = [](VU bits) {
        const V whole = hn::ConvertTo(d, hn::BitCast(di, bits));
        return hn::Sub(hn::Div(hn::Sub(whole, set(1.0F)), set(32767.0F)), set(1.0F));
    };
    const V u = part(hn::And(code, hn::Set(du, 0xFFFFU)));
    const V v = part(hn::ShiftRight<16>(code));
    const V one = set(1.0F);
    const V z = hn::Sub(hn::Sub(one, hn::Abs(u)), hn::Abs(v));
    const M folded = hn::Lt(z, hn::Zero(d));
    const Directions n =
        normalised({hn::IfThenElse(folded, hn::Mul(hn::Sub(one, hn::Abs(v)), signOf(u)), u),
                    hn::IfThenElse(folded, hn::Mul(hn::Sub(one, hn::Abs(u)), signOf(v)), v), z});
    const M known = hn::RebindMask(d, hn::Ne(code, hn::Zero(du)));
    return {hn::IfThenElseZero(known, n.x), hn::IfThenElseZero(known, n.y),
            hn::IfThenElseZero(known, n.z)};
}

/// compact::encodeDirection
HWY_INLINE VU encodeDirections(const Directions& n) {
    const V one = set(1.0F);
    const V sum = hn::Add(hn::Add(hn::Abs(n.x), hn::Abs(n.y)), hn::Abs(n.z));
    const V u = hn::Div(n.x, sum), v = hn::Div(n.y, sum);
    const M below = hn::Lt(n.z, hn::Zero(d));
    const auto quantised = [](V x) {
        const V scaled = hn::Add(hn::Mul(hn::Add(x, set(1.0F)), set(32767.0F)), set(1.5F));
        return hn::BitCast(du, hn::ConvertTo(di, scaled));
    };
    const VU low =
        quantised(hn::IfThenElse(below, hn::Mul(hn::Sub(one, hn::Abs(v)), signOf(u)), u));
    const VU high =
        quantised(hn::IfThenElse(below, hn::Mul(hn::Sub(one, hn::Abs(u)), signOf(v)), v));
    const auto known = hn::RebindMask(du, hn::Gt(sum, hn::Zero(d)));
    return hn::IfThenElseZero(known, hn::Or(low, hn::ShiftLeft<16>(high)));
}

/// compact::Sigma::encode
HWY_INLINE VI encodeSigma(V sigma) {
    using Sigma = compact::Sigma;
    const VI bits = hn::Add(hn::BitCast(di, sigma), hn::Set(di, 1 << (Sigma::kShift - 1)));
    const VI code = hn::Sub(hn::ShiftRight<Sigma::kShift>(bits), hn::Set(di, Sigma::kBias));
    return hn::Min(hn::Max(code, hn::Zero(di)), hn::Set(di, Sigma::kMax));
}

HWY_INLINE V dot(const Eigen::Matrix3f& r, Eigen::Index row, V x, V y, V z) {
    // In the order of Eigen's products.
    return hn::Add(hn::Mul(set(r(row, 0)), x),
                   hn::Add(hn::Mul(set(r(row, 1)), y), hn::Mul(set(r(row, 2)), z)));
}

/// A vector of slots, all of which have a pixel.
class Fuser {
 public:
    HWY_INLINE Fuser(const ViewPoints& view, VI pixel) : view_(view), pixel_(pixel) {
        // The quotient of floats is off by one at most.
        const V width = set(static_cast<float>(view.width));
        const VI w = hn::Set(di, view.width);
        VI row = hn::ConvertTo(di, hn::Div(hn::ConvertTo(d, pixel), width));
        VI column = hn::Sub(pixel, hn::Mul(row, w));
        const auto less = hn::Lt(column, hn::Zero(di));
        row = hn::IfThenElse(less, hn::Sub(row, hn::Set(di, 1)), row);
        column = hn::IfThenElse(less, hn::Add(column, w), column);
        const auto more = hn::Gt(column, hn::Set(di, view.width - 1));
        row_ = hn::IfThenElse(more, hn::Add(row, hn::Set(di, 1)), row);
        column_ = hn::IfThenElse(more, hn::Sub(column, w), column);
        z_ = hn::GatherIndex(d, view.z.data(), pixel);
        sigma_ = hn::GatherIndex(d, view.sigma.data(), pixel);
    }
    V z_, sigma_;

    /// The pixel's point in the map frame.
    HWY_INLINE Directions point() const {
        const V x =
            hn::Div(hn::Mul(hn::Sub(hn::ConvertTo(d, column_), set(view_.cx)), z_), set(view_.fx));
        const V y =
            hn::Div(hn::Mul(hn::Sub(hn::ConvertTo(d, row_), set(view_.cy)), z_), set(view_.fy));
        const auto axis = [&](Eigen::Index i) {
            return hn::Add(dot(view_.rotation, i, x, y, z_), set(view_.translation[i]));
        };
        return {axis(0), axis(1), axis(2)};
    }
    /// The normal of the pixel's patch in the map frame; false where the pixel is not on it.
    HWY_INLINE M patchNormal(Directions& normal) const {
        static_assert(std::is_standard_layout_v<PatchPlane> && sizeof(PatchPlane) % 4 == 0);
        constexpr int kStride = sizeof(PatchPlane) / 4;
        static_assert(ViewPoints::kPatch == 4);
        const VI patchColumn = hn::ShiftRight<2>(column_), patchRow = hn::ShiftRight<2>(row_);
        const VI at =
            hn::Mul(hn::Add(hn::Mul(patchRow, hn::Set(di, view_.patchColumns())), patchColumn),
                    hn::Set(di, kStride));
        const auto* base = reinterpret_cast<const float*>(view_.patches.data());
        const auto field = [&](std::size_t offset) {
            return hn::GatherIndex(d, base + offset / 4, at);
        };
        const VI two = hn::Set(di, 2);
        const VI centreColumn = hn::Add(hn::ShiftLeft<2>(patchColumn), two);
        const VI centreRow =
            hn::Min(hn::Add(hn::ShiftLeft<2>(patchRow), two), hn::Set(di, view_.height - 1));
        const V dc = hn::ConvertTo(d, hn::Sub(column_, centreColumn));
        const V dr = hn::ConvertTo(d, hn::Sub(row_, centreRow));
        const V expected = hn::Add(hn::Add(field(offsetof(PatchPlane, value)),
                                           hn::Mul(field(offsetof(PatchPlane, slopeColumn)), dc)),
                                   hn::Mul(field(offsetof(PatchPlane, slopeRow)), dr));
        const V off =
            hn::Abs(hn::Sub(hn::GatherIndex(d, view_.disparity.data(), pixel_), expected));
        const std::size_t n = offsetof(PatchPlane, normal);
        const V x = field(n), y = field(n + 4), z = field(n + 8);
        normal = {dot(view_.rotation, 0, x, y, z), dot(view_.rotation, 1, x, y, z),
                  dot(view_.rotation, 2, x, y, z)};
        return hn::Le(off, field(offsetof(PatchPlane, tolerance)));
    }

 private:
    const ViewPoints& view_;
    VI pixel_, row_, column_;
};

HWY_INLINE void move(float* at, V step, M there) {
    const V old = hn::LoadU(d, at);
    hn::StoreU(hn::IfThenElse(there, hn::Add(old, step), old), d, at);
}

void fuseOf(const ViewPoints& view, Page& page, PageFusion& fusion) {
    const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
    fusion.moved = fusion.roundEdge = 0;
    for (std::uint32_t slot = 0; slot < Page::kSize; slot += lanes) {
        const M there = slotMask(fusion.matched, slot);
        if (hn::AllFalse(d, there)) {
            continue;
        }
        const Fuser fuser(view, hn::BitCast(di, hn::LoadU(du, fusion.pixel.data() + slot)));
        const V a = hn::Max(hn::LoadU(d, fusion.before + slot), set(kTinySigma));
        const V b = hn::Max(fuser.sigma_, set(kLeastSigma));
        const V aa = hn::Mul(a, a), sum = hn::Add(aa, hn::Mul(b, b));
        const V gain = hn::Div(aa, sum);
        hn::StoreU(gain, d, fusion.gain.data() + slot);

        const Directions point = fuser.point();
        const auto stepTo = [&](V to, const float* from) {
            return hn::Mul(gain, hn::Sub(to, hn::LoadU(d, from)));
        };
        const V dx = stepTo(point.x, page.x.data() + slot);
        const V dy = stepTo(point.y, page.y.data() + slot);
        const V dz = stepTo(point.z, page.z.data() + slot);
        move(page.x.data() + slot, dx, there);
        move(page.y.data() + slot, dy, there);
        move(page.z.data() + slot, dz, there);

        const V sigma = hn::Div(hn::Mul(a, b), hn::Sqrt(sum));
        hn::StoreU(sigma, d, fusion.sigma.data() + slot);
        const VI oldCode = hn::PromoteTo(di, hn::LoadU(d16, page.sigma.data() + slot));
        const VI code = hn::IfThenElse(hn::RebindMask(di, there), encodeSigma(sigma), oldCode);
        hn::StoreU(hn::DemoteTo(d16, code), d16, page.sigma.data() + slot);

        const V spacing = hn::Mul(fuser.z_, set(view.footprint));
        const M noisy = hn::Gt(fuser.sigma_, hn::Mul(set(kNoisy), spacing));
        const V length =
            hn::Sqrt(hn::Add(hn::Mul(dx, dx), hn::Add(hn::Mul(dy, dy), hn::Mul(dz, dz))));
        const M far = hn::Gt(length, hn::Mul(set(0.02F), spacing));
        fusion.moved |= slotBits(hn::And(there, hn::AndNot(noisy, far)), slot);
        if (hn::AllFalse(d, hn::And(there, noisy))) {
            continue;
        }
        Directions seen;
        const M onPatch = fuser.patchNormal(seen);
        const VU old = hn::LoadU(du, page.normal.data() + slot);
        const Directions known = decodeDirections(old);
        const M renew = hn::And(there, hn::And(noisy, onPatch));
        const V cosine = hn::Add(hn::Mul(known.x, seen.x),
                                 hn::Add(hn::Mul(known.y, seen.y), hn::Mul(known.z, seen.z)));
        const M apart =
            hn::And(hn::RebindMask(d, hn::Ne(old, hn::Zero(du))), hn::Lt(cosine, set(kSameSide)));
        fusion.roundEdge |= slotBits(hn::And(renew, apart), slot);
        const V rest = hn::Sub(set(1.0F), gain);
        const auto mixed = [&](V was, V is) {
            return hn::Add(hn::Mul(rest, was), hn::Mul(gain, is));
        };
        const VU normal = encodeDirections(
            {mixed(known.x, seen.x), mixed(known.y, seen.y), mixed(known.z, seen.z)});
        hn::StoreU(hn::IfThenElse(hn::RebindMask(du, renew), normal, old), du,
                   page.normal.data() + slot);
    }
}

}  // namespace
}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap {

HWY_EXPORT(fuseOf);

void fuseMatched(const ViewPoints& view, Page& page, PageFusion& fusion) {
    HWY_DYNAMIC_DISPATCH(fuseOf)(view, page, fusion);
}

}  // namespace riftmap
#endif
