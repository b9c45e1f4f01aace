// SPDX-License-Identifier: BSD-3-Clause
#include "fuse_kernel.h"

#include <array>
#include <bit>
#include <cstddef>
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fuse_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "slot_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
using DI = hn::Rebind<std::int32_t, D>;
using DU = hn::Rebind<std::uint32_t, D>;
using D16 = hn::Rebind<std::uint16_t, D>;
using D8 = hn::Rebind<std::uint8_t, D>;
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

/// compact::SmallFloat::encode of what is not negative
template <class Code>
HWY_INLINE VI encode(V value) {
    const VI bits = hn::Add(hn::BitCast(di, value), hn::Set(di, 1 << (Code::kShift - 1)));
    const VI code = hn::Sub(hn::ShiftRight<Code::kShift>(bits), hn::Set(di, Code::kBias));
    return hn::Min(hn::Max(code, hn::Zero(di)), hn::Set(di, Code::kMax));
}
/// The nearest float, as a conversion of all 32 bits at once would give.
HWY_INLINE V toFloat(VU whole) {
    const auto half = [](VU bits) { return hn::ConvertTo(d, hn::BitCast(di, bits)); };
    return hn::Add(hn::Mul(half(hn::ShiftRight<16>(whole)), set(65536.0F)),
                   half(hn::And(whole, hn::Set(du, 0xFFFFU))));
}
HWY_INLINE hn::Mask<DU> has(VU flags, std::uint32_t bits) {
    return hn::Ne(hn::And(flags, hn::Set(du, bits)), hn::Zero(du));
}
HWY_INLINE VU bitWhere(hn::Mask<DU> mask, std::uint32_t bit) {
    return hn::IfThenElseZero(mask, hn::Set(du, bit));
}
HWY_INLINE VU loadBytes(const std::uint8_t* at) {
    return hn::PromoteTo(du, hn::LoadU(D8(), at));
}
HWY_INLINE void storeBytes(VU values, std::uint8_t* at) {
    hn::StoreU(hn::DemoteTo(D8(), hn::BitCast(di, values)), D8(), at);
}

HWY_INLINE V dot(const Eigen::Matrix3f& r, Eigen::Index row, V x, V y, V z) {
    // In the order of Eigen's products.
    return hn::Add(hn::Mul(set(r(row, 0)), x),
                   hn::Add(hn::Mul(set(r(row, 1)), y), hn::Mul(set(r(row, 2)), z)));
}

/// A vector of slots, all of which have a pixel.
class Fuser {
 public:
    HWY_INLINE Fuser(const ViewPoints& view, VI pixel) : view_(view) {
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
    /// The normal of the pixel's patch in the map frame.
    HWY_INLINE Directions patchNormal() const {
        static_assert(std::is_standard_layout_v<PatchPlane> && sizeof(PatchPlane) % 4 == 0);
        constexpr int kStride = sizeof(PatchPlane) / 4;
        static_assert(ViewPoints::kPatch == 4);
        const VI patch =
            hn::Add(hn::Mul(hn::ShiftRight<2>(row_), hn::Set(di, view_.patchColumns())),
                    hn::ShiftRight<2>(column_));
        const VI at = hn::Mul(patch, hn::Set(di, kStride));
        const auto* base =
            reinterpret_cast<const float*>(view_.patches.data()) + offsetof(PatchPlane, normal) / 4;
        const V x = hn::GatherIndex(d, base, at), y = hn::GatherIndex(d, base + 1, at),
                z = hn::GatherIndex(d, base + 2, at);
        return {dot(view_.rotation, 0, x, y, z), dot(view_.rotation, 1, x, y, z),
                dot(view_.rotation, 2, x, y, z)};
    }

 private:
    const ViewPoints& view_;
    VI row_, column_;
};

HWY_INLINE void move(float* at, V step, M there) {
    const V old = hn::LoadU(d, at);
    hn::StoreU(hn::IfThenElse(there, hn::Add(old, step), old), d, at);
}

/// Stores codes of 16 bits where the mask is set.
HWY_INLINE void storeCodes(VI codes, M there, std::uint16_t* at) {
    const VI old = hn::PromoteTo(di, hn::LoadU(d16, at));
    hn::StoreU(hn::DemoteTo(d16, hn::IfThenElse(hn::RebindMask(di, there), codes, old)), d16, at);
}

/// What the page's vertices are to become, a slot a value.
struct Fused {
    alignas(64) std::array<float, Page::kSize> gain{};  ///< weight of the pixel; 0 = not matched
    alignas(64) std::array<std::uint32_t, Page::kSize> look{};
};

/// Colours byte by byte; the compiler makes vectors of this itself.
void fuseColours(const Fused& fused, Page& page) {
    constexpr std::size_t kBytes = 3 * Page::kSize;
    std::array<float, kBytes> gain;
    std::array<std::uint8_t, kBytes> seen;
    for (std::size_t slot = 0; slot < Page::kSize; ++slot) {
        for (std::size_t i = 0; i < 3; ++i) {
            gain[3 * slot + i] = fused.gain[slot];
            seen[3 * slot + i] = static_cast<std::uint8_t>(fused.look[slot] >> (8 * i));
        }
    }
    auto* rgb = page.rgb[0].data();
    for (std::size_t i = 0; i < kBytes; ++i) {
        const auto before = static_cast<float>(rgb[i]);
        rgb[i] = static_cast<std::uint8_t>(
            compact::roundNearest(before + gain[i] * (static_cast<float>(seen[i]) - before)));
    }
}

struct Place {
    V sigma;
    /// The normal until now lies more than 45 degrees off that of the pixel, where noise makes the
    /// gate wide: the pixel shows the surface round an edge.
    M roundEdge;
};

/// Position, sigma and normal of the slots of a vector.
HWY_INLINE Place fusePlaces(const ViewPoints& view, const Fuser& fuser, M there, VU look,
                            std::uint32_t slot, Page& page, PageFusion& fusion, Fused& fused) {
    const V a = hn::Max(hn::LoadU(d, fusion.before + slot), set(kTinySigma));
    const V b = hn::Max(fuser.sigma_, set(kLeastSigma));
    const V aa = hn::Mul(a, a), sum = hn::Add(aa, hn::Mul(b, b));
    const V gain = hn::Div(aa, sum);
    hn::Store(hn::IfThenElseZero(there, gain), d, fused.gain.data() + slot);
    hn::Store(look, du, fused.look.data() + slot);

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
    storeCodes(encode<compact::Sigma>(sigma), there, page.sigma.data() + slot);

    const V spacing = hn::Mul(fuser.z_, set(view.footprint));
    const M noisy = hn::Gt(fuser.sigma_, hn::Mul(set(kNoisy), spacing));
    const V length = hn::Sqrt(hn::Add(hn::Mul(dx, dx), hn::Add(hn::Mul(dy, dy), hn::Mul(dz, dz))));
    const M far = hn::Gt(length, hn::Mul(set(0.02F), spacing));
    fusion.moved |= slotBits(d, hn::And(there, hn::AndNot(noisy, far)), slot);
    const M renew =
        hn::And(hn::And(there, noisy), hn::RebindMask(d, has(look, ViewPoints::kOnPatch)));
    if (hn::AllFalse(d, renew)) {
        return {sigma, renew};
    }
    const Directions seen = fuser.patchNormal();
    const VU old = hn::LoadU(du, page.normal.data() + slot);
    const Directions known = decodeDirections(old);
    const V cosine = hn::Add(hn::Mul(known.x, seen.x),
                             hn::Add(hn::Mul(known.y, seen.y), hn::Mul(known.z, seen.z)));
    const M apart =
        hn::And(hn::RebindMask(d, hn::Ne(old, hn::Zero(du))), hn::Lt(cosine, set(kSameSide)));
    const V rest = hn::Sub(set(1.0F), gain);
    const auto mixed = [&](V was, V is) { return hn::Add(hn::Mul(rest, was), hn::Mul(gain, is)); };
    const VU normal =
        encodeDirections({mixed(known.x, seen.x), mixed(known.y, seen.y), mixed(known.z, seen.z)});
    hn::StoreU(hn::IfThenElse(hn::RebindMask(du, renew), normal, old), du,
               page.normal.data() + slot);
    return {sigma, hn::And(renew, apart)};
}

/// State and openness.
HWY_INLINE void updateState(M there, VU flags, V sigma, std::uint32_t slot, Page& page,
                            PageFusion& fusion) {
    const VU old = loadBytes(page.state.data() + slot);
    const VU said = hn::Or(hn::IfThenZeroElse(has(flags, Association::kSomeOpen),
                                              hn::Set(du, std::uint32_t{kSurrounded})),
                           bitWhere(has(flags, Association::kSomeFine), kFineEnough));
    // One view less that saw through it.
    const VU one = bitWhere(has(old, kEvidenceMask), 1U << kEvidenceShift);
    const VU state = hn::Sub(hn::Or(old, said), one);

    // Reasons that both views give are better than those of one; else the newer view knows.
    const VU oldOpen = loadBytes(page.open.data() + slot);
    const VU now = hn::AndNot(hn::Set(du, std::uint32_t{kTooCoarse}),
                              hn::ShiftRight<Association::kKindsShift>(flags));
    const VU both = hn::And(oldOpen, now);
    const VU kinds = hn::IfThenElse(hn::Ne(both, hn::Zero(du)), both, now);
    // openBits
    VU open = hn::IfThenZeroElse(has(state, kSurrounded), kinds);
    if (fusion.typedOpenness) {
        const auto rough =
            hn::RebindMask(du, hn::Gt(hn::Add(sigma, sigma), set(fusion.targetResolution)));
        open = hn::Or(open, bitWhere(hn::Or(hn::Not(has(state, kFineEnough)), rough), kTooCoarse));
    }
    const auto mask = hn::RebindMask(du, there);
    const auto touched = hn::And(mask, hn::Ne(hn::Or(open, oldOpen), hn::Zero(du)));
    fusion.touched = fusion.touched || !hn::AllFalse(du, touched);
    storeBytes(hn::IfThenElse(mask, state, old), page.state.data() + slot);
    storeBytes(hn::IfThenElse(mask, open, oldOpen), page.open.data() + slot);
}

/// The pixels of a vertex are its share of the surface, where none of them is cut off.
HWY_INLINE void updateArea(M whole, VU area, std::uint32_t slot, Page& page) {
    const V metres = hn::Mul(toFloat(area), set(Association::kAreaUnit));
    storeCodes(encode<compact::Area>(metres), whole, page.area.data() + slot);
}

std::int64_t areaUnits(const std::array<std::uint16_t, Page::kSize>& codes) {
    std::int64_t sum = 0;
    for (const std::uint16_t code : codes) {
        sum += compact::areaUnits(code);
    }
    return sum;
}

void fuseOf(const ViewPoints& view, Page& page, PageFusion& fusion) {
    const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
    const std::array<std::uint16_t, Page::kSize> oldArea = page.area;
    fusion.matched = fusion.moved = 0;
    fusion.touched = false;
    Fused fused;
    for (std::uint32_t slot = 0; slot < Page::kSize; slot += lanes) {
        VU pixel, distance, surface, flags;
        static_assert(std::endian::native == std::endian::little &&
                      sizeof(Association::Claims) == 16);
        hn::LoadInterleaved4(du, reinterpret_cast<const std::uint32_t*>(fusion.claims + slot),
                             pixel, distance, surface, flags);
        const M there = hn::And(slotMask(fusion.inView, slot),
                                hn::RebindMask(d, hn::Ne(pixel, hn::Set(du, Association::kNone))));
        if (hn::AllFalse(d, there)) {
            continue;
        }
        fusion.matched |= slotBits(d, there, slot);
        pixel = hn::IfThenElseZero(hn::RebindMask(du, there), pixel);
        const VI at = hn::BitCast(di, pixel);
        Place place{hn::LoadU(d, fusion.before + slot), hn::AndNot(there, there)};
        if (!fusion.firstStays) {
            const VU look = hn::GatherIndex(du, view.look.data(), at);
            place = fusePlaces(view, Fuser(view, at), there, look, slot, page, fusion, fused);
        }
        updateState(there, flags, place.sigma, slot, page, fusion);
        // Seen at less than 60 degrees: its share of the surface can be told.
        const V stretch = hn::GatherIndex(d, view.stretch.data(), at);
        const M frontal = hn::And(hn::Ge(stretch, set(1.0F)), hn::Le(stretch, set(2.0F)));
        const auto cut = has(flags, Association::kSomeOpen);
        const auto uncut = hn::AndNot(cut, has(flags, Association::kSomeSurrounded));
        const M whole = hn::And(hn::And(there, frontal), hn::RebindMask(d, uncut));
        updateArea(hn::AndNot(place.roundEdge, whole), surface, slot, page);
    }
    fusion.area = areaUnits(page.area) - areaUnits(oldArea);
    if (fusion.matched != 0 && !fusion.firstStays) {
        fuseColours(fused, page);
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
