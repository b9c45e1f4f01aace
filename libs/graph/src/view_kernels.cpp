// SPDX-License-Identifier: BSD-3-Clause
#include "view_kernels.h"

#include <algorithm>
#include <array>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "view_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "vector_tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
using DI = hn::Rebind<std::int32_t, D>;
using D16 = hn::Rebind<std::uint16_t, D>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;
constexpr D d;
constexpr DI di;
constexpr D16 d16;

HWY_INLINE V set(float x) {
    return hn::Set(d, x);
}
HWY_INLINE int lanes() {
    return static_cast<int>(hn::Lanes(d));
}
HWY_INLINE V load(const float* from, int left) {
    return loadSome(d, from, left);
}
HWY_INLINE void store(V v, float* to, int left) {
    storeSome(v, d, to, left);
}

std::size_t depthsOf(const DepthRow& in) {
    const V infinity = set(std::numeric_limits<float>::infinity());
    std::size_t count = 0;
    for (int c = 0; c < in.width; c += lanes()) {
        const int left = in.width - c;
        const V disparity = hn::Add(load(in.disparity + c, left), set(in.doffs));
        const V deviation = load(in.deviation + c, left);
        const V depth = hn::Div(set(in.fb), disparity);
        const V sigma = hn::Div(hn::Mul(hn::Mul(depth, depth), deviation), set(in.fb));
        // A depth that is not known within a third of itself is no point of the surface.
        const M sane = hn::And(hn::Lt(disparity, infinity), hn::Gt(disparity, hn::Zero(d)));
        const M known =
            hn::And(hn::Ge(sigma, hn::Zero(d)), hn::Lt(hn::Mul(set(3.0F), sigma), depth));
        const M ok = hn::And(hn::And(sane, known),
                             hn::FirstN(d, static_cast<std::size_t>(std::max(left, 0))));
        store(hn::IfThenElseZero(ok, depth), in.z + c, left);
        store(hn::IfThenElseZero(ok, sigma), in.sigma + c, left);
        store(hn::IfThenElse(ok, disparity, set(std::numeric_limits<float>::quiet_NaN())),
              in.corrected + c, left);
        count += hn::CountTrue(d, ok);
    }
    return count;
}

/// Sums for the least-squares plane d = a x + b y + e over pixels.
struct PlaneSums {
    V n, x, y, d1, xx, xy, yy, xd, yd;
    HWY_INLINE PlaneSums() { n = x = y = d1 = xx = xy = yy = xd = yd = hn::Zero(d); }
    HWY_INLINE void add(M there, V px, V py, V pd) {
        const V mx = hn::IfThenElseZero(there, px), my = hn::IfThenElseZero(there, py);
        const V md = hn::IfThenElseZero(there, pd);
        n = hn::Add(n, hn::IfThenElseZero(there, set(1.0F)));
        x = hn::Add(x, mx);
        y = hn::Add(y, my);
        d1 = hn::Add(d1, md);
        xx = hn::Add(xx, hn::Mul(mx, mx));
        xy = hn::Add(xy, hn::Mul(mx, my));
        yy = hn::Add(yy, hn::Mul(my, my));
        xd = hn::Add(xd, hn::Mul(mx, md));
        yd = hn::Add(yd, hn::Mul(my, md));
    }
    /// False with fewer than 9 pixels or all in a line.
    HWY_INLINE M solve(V& a, V& b, V& e) const {
        const auto spread = [this](V pq, V p, V q) {
            return hn::Sub(pq, hn::Div(hn::Mul(p, q), n));
        };
        const V vxx = spread(xx, x, x), vxy = spread(xy, x, y), vyy = spread(yy, y, y);
        const V vxd = spread(xd, x, d1), vyd = spread(yd, y, d1);
        const V det = hn::Sub(hn::Mul(vxx, vyy), hn::Mul(vxy, vxy));
        a = hn::Div(hn::Sub(hn::Mul(vxd, vyy), hn::Mul(vyd, vxy)), det);
        b = hn::Div(hn::Sub(hn::Mul(vyd, vxx), hn::Mul(vxd, vxy)), det);
        e = hn::Div(hn::Sub(hn::Sub(d1, hn::Mul(a, x)), hn::Mul(b, y)), n);
        return hn::And(hn::Ge(n, set(9.0F)), hn::Gt(det, hn::Mul(hn::Mul(set(1e-3F), n), n)));
    }
};

/// The windows of a vector of patches: disparities relative to the centres.
class Windows {
 public:
    HWY_INLINE Windows(const PatchRow& in, int first, V middle, M noisy) {
        // Columns from 4 k + 2 - reach to 4 k + 2 + reach as planes of columns modulo 4.
        struct Place {
            int plane, shift;
        };
        constexpr std::array<Place, 5> kNear = {{{0, 0}, {1, 0}, {2, 0}, {3, 0}, {0, 1}}};
        constexpr std::array<Place, 5> kFar = {{{0, -1}, {3, -1}, {2, 0}, {1, 1}, {0, 2}}};
        const bool anyNoisy = !hn::AllFalse(d, noisy), allNoisy = hn::AllTrue(d, noisy);
        const auto at = [&](const float* row, const Place& place) {
            return hn::LoadU(
                d, row + static_cast<std::size_t>(place.plane) * in.stride +
                       static_cast<std::size_t>(first + ViewPoints::kPhasePad + place.shift));
        };
        for (std::size_t r = 0; r < 5; ++r) {
            for (std::size_t c = 0; c < 5; ++c) {
                V value = allNoisy ? hn::Zero(d) : at(in.near[r], kNear[c]);
                if (anyNoisy) {
                    value = hn::IfThenElse(noisy, at(in.far[r], kFar[c]), value);
                }
                hn::StoreU(hn::Sub(value, middle), d, values_[r][c].data());
            }
        }
        step_ = hn::IfThenElse(noisy, set(3.0F), set(1.0F));
    }
    /// Sums over the pixels that differ by `tolerance` at most from e + a x + b y.
    HWY_INLINE PlaneSums collect(V a, V b, V e, V tolerance) const {
        PlaneSums sums;
        for (int r = 0; r < 5; ++r) {
            const V y = hn::Mul(step_, set(static_cast<float>(r - 2)));
            for (int c = 0; c < 5; ++c) {
                const V x = hn::Mul(step_, set(static_cast<float>(c - 2)));
                const V value = hn::LoadU(
                    d, values_[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)].data());
                const V expected = hn::Add(hn::Add(e, hn::Mul(a, x)), hn::Mul(b, y));
                // Not a number, where there is no vertex, is never within anything.
                sums.add(hn::Le(hn::Abs(hn::Sub(value, expected)), tolerance), x, y, value);
            }
        }
        return sums;
    }

 private:
    std::array<std::array<std::array<float, hn::MaxLanes(D())>, 5>, 5> values_;
    V step_;
};

void fitPatches(const PatchRow& in) {
    constexpr std::size_t kMost = hn::MaxLanes(D());
    const V zero = hn::Zero(d);
    for (int first = 0; first < in.patchCount; first += lanes()) {
        const int n = std::min(lanes(), in.patchCount - first);
        HWY_ALIGN std::array<float, kMost> buffer{};
        for (int k = 0; k < n; ++k) {
            const int column = (first + k) * ViewPoints::kPatch + ViewPoints::kPatch / 2;
            buffer[static_cast<std::size_t>(k)] = column < in.width ? in.deviation[column] : 0.0F;
        }
        const V deviation = hn::Load(d, buffer.data());
        const V middle = hn::LoadU(d, in.near[2] + 2 * in.stride +
                                          static_cast<std::size_t>(first + ViewPoints::kPhasePad));
        const V fb = set(in.fb);
        const V z = hn::Div(fb, middle);
        const V sigma = hn::Div(hn::Mul(hn::Mul(z, z), deviation), fb);
        // Where noise hides the slope between neighbours, look farther.
        const M noisy = hn::Gt(sigma, hn::Mul(hn::Mul(set(0.25F), z), set(in.footprint)));
        const V radius = hn::IfThenElse(noisy, set(6.0F), set(2.0F));
        const V steepest =
            hn::Div(set(ViewPoints::kLargestStretch * in.fb), hn::Mul(set(in.fx), z));
        const V wide = hn::Add(hn::Mul(set(4.0F), deviation), hn::Mul(steepest, radius));
        const V tolerance = hn::Add(hn::Mul(set(3.0F), deviation), set(0.05F));

        const Windows windows(in, first, middle, noisy);
        V a = zero, b = zero, e = zero;
        const M rough = windows.collect(zero, zero, zero, wide).solve(a, b, e);
        const M fine = hn::And(rough, windows.collect(a, b, e, tolerance).solve(a, b, e));

        // n / distance of the plane n . X = distance, from disparity = fb (n . ray) / distance.
        const V value = hn::Add(middle, e);
        HWY_ALIGN std::array<float, kMost> right{};
        for (int k = 0; k < n; ++k) {
            right[static_cast<std::size_t>(k)] =
                in.cx -
                static_cast<float>((first + k) * ViewPoints::kPatch + ViewPoints::kPatch / 2);
        }
        const V x = hn::Div(a, set(in.fb / in.fx));
        const V y = hn::Div(hn::Mul(b, set(in.fy)), fb);
        const V ahead = hn::Add(hn::Add(value, hn::Mul(hn::Load(d, right.data()), a)),
                                hn::Mul(set(in.cy - static_cast<float>(in.row)), b));
        const V zc = hn::Div(ahead, fb);
        const V length = hn::Sqrt(hn::Add(hn::Mul(x, x), hn::Add(hn::Mul(y, y), hn::Mul(zc, zc))));

        HWY_ALIGN std::array<std::array<float, kMost>, 8> out;
        hn::Store(a, d, out[0].data());
        hn::Store(b, d, out[1].data());
        hn::Store(value, d, out[2].data());
        hn::Store(hn::IfThenElse(fine, tolerance, set(-1.0F)), d, out[3].data());
        hn::Store(length, d, out[4].data());
        hn::Store(hn::Div(hn::Neg(x), length), d, out[5].data());
        hn::Store(hn::Div(hn::Neg(y), length), d, out[6].data());
        hn::Store(hn::Div(hn::Neg(zc), length), d, out[7].data());
        for (int k = 0; k < n; ++k) {
            const auto i = static_cast<std::size_t>(k);
            PatchPlane& plane = in.patches[first + k];
            plane = PatchPlane{};
            plane.column = (first + k) * ViewPoints::kPatch + ViewPoints::kPatch / 2;
            plane.row = in.row;
            if (out[3][i] >= 0) {
                plane.slopeColumn = out[0][i];
                plane.slopeRow = out[1][i];
                plane.value = out[2][i];
                plane.tolerance = out[3][i];
                plane.inverseDistance = out[4][i];
                plane.normal = {out[5][i], out[6][i], out[7][i]};
            }
        }
    }
}

HWY_INLINE V rayLength(const AngleRow& in, int c, int left) {
    const V x = load(in.rayX + c, left), y = set(in.rayY);
    return hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), set(1.0F)));
}

void anglesOf(const AngleRow& in, std::uint8_t* onPlane) {
    const hn::Rebind<std::uint8_t, D> d8;
    for (int c = 0; c < in.width; c += lanes()) {
        const int left = in.width - c;
        const V z = load(in.z + c, left);
        const V expected = hn::Add(load(in.value + c, left),
                                   hn::Mul(load(in.slopeRow + c, left), set(in.rowsFromCentre)));
        const V off = hn::Abs(hn::Sub(load(in.disparity + c, left), expected));
        const M on = hn::And(hn::Le(off, load(in.tolerance + c, left)), hn::Gt(z, hn::Zero(d)));
        // cos = |n . ray| / |ray| and z = distance / (n . ray)
        const V angle = hn::Mul(hn::Mul(load(in.inverse + c, left), z), rayLength(in, c, left));
        const V most = set(ViewPoints::kLargestStretch);
        const V clamped = hn::Min(hn::Max(angle, set(1.0F)), most);
        store(hn::IfThenElseZero(hn::And(on, hn::Gt(angle, hn::Zero(d))), clamped), in.stretch + c,
              left);
        const auto flag = hn::IfThenElseZero(hn::RebindMask(di, on), hn::Set(di, 1));
        const auto bytes = hn::DemoteTo(d8, flag);
        storeSome(bytes, d8, onPlane + c, left);
    }
}

void areasOf(const AngleRow& in) {
    for (int c = 0; c < in.width; c += lanes()) {
        const int left = in.width - c;
        const V z = load(in.z + c, left);
        const V surface = hn::Mul(hn::Mul(z, z), hn::Max(set(1.0F), load(in.stretch + c, left)));
        store(hn::Div(surface, hn::Mul(set(in.fxfy), rayLength(in, c, left))), in.area + c, left);
    }
}

void looksOf(const LookRow& in) {
    // The compiler makes vectors of these itself.
    const auto onPatch = [&in](int c) { return in.onPlane[c] * ViewPoints::kOnPatch; };
    if (in.channels == 3) {
        for (int c = 0; c < in.width; ++c) {
            const std::uint8_t* at = in.image + 3 * static_cast<std::ptrdiff_t>(c);
            in.look[c] =
                onPatch(c) | unsigned{at[2]} | unsigned{at[1]} << 8U | unsigned{at[0]} << 16U;
        }
        return;
    }
    for (int c = 0; c < in.width; ++c) {
        const unsigned grey = in.channels == 0 ? 128U : unsigned{in.image[c]};
        in.look[c] = onPatch(c) | grey * 0x010101U;
    }
}

HWY_INLINE V square(V x) {
    return hn::Mul(x, x);
}

void edgesOf(const EdgeRow& in) {
    for (int c = 0; c < in.count; c += lanes()) {
        const int left = in.count - c;
        const V z = load(in.z + c, left), z2 = load(in.z2 + c, left);
        const V dx =
            hn::Sub(hn::Mul(load(in.rayX2 + c, left), z2), hn::Mul(load(in.rayX + c, left), z));
        const V dy = hn::Sub(hn::Mul(set(in.rayY2), z2), hn::Mul(set(in.rayY), z));
        const V dz = hn::Sub(z2, z);
        const V squared = hn::Add(hn::Add(square(dx), square(dy)), square(dz));
        M high;
        if (in.delta > 0) {
            high = hn::Gt(squared, set(in.delta * in.delta));
        } else {
            const V spacing = hn::Mul(set(in.footprint), hn::Max(z, z2));
            high = hn::Gt(squared, square(hn::Add(set(in.target), spacing)));
            if (!hn::AllFalse(d, high)) {
                const V noise =
                    hn::Mul(set(3.0F), hn::Sqrt(hn::Add(square(load(in.sigma + c, left)),
                                                        square(load(in.sigma2 + c, left)))));
                const V tolerance = hn::Add(set(in.target), noise);
                high = hn::And(high, hn::Gt(squared, square(hn::Add(tolerance, spacing))));
            }
        }
        // compact::Weight::encode(sqrt(squared))
        using Weight = compact::Weight;
        const auto bits = hn::BitCast(di, hn::Sqrt(squared));
        const auto rounded = hn::Sub(
            hn::ShiftRight<Weight::kShift>(hn::Add(bits, hn::Set(di, 1 << (Weight::kShift - 1)))),
            hn::Set(di, Weight::kBias));
        const auto weight =
            hn::Min(hn::Max(rounded, hn::Zero(di)), hn::Set(di, std::int32_t{0x7FFE}));
        const auto flagged =
            hn::Or(weight, hn::IfThenElseZero(hn::RebindMask(di, high),
                                              hn::Set(di, std::int32_t{compact::kHighBit})));
        const M both = hn::And(hn::Gt(z, hn::Zero(d)), hn::Gt(z2, hn::Zero(d)));
        const auto code = hn::IfThenElse(hn::RebindMask(di, both), flagged,
                                         hn::Set(di, std::int32_t{ViewPoints::kNoEdge}));
        const auto narrow = hn::DemoteTo(d16, code);
        storeSome(narrow, d16, in.code + c, left);
    }
}

void kindsOf(const KindRow& in) {
    // Each look gives a bit; the compiler makes vectors of this itself.
    const auto look = [](std::uint16_t code, bool beforeFirst) {
        const unsigned none = beforeFirst ? unsigned{kImageBorder} : unsigned{kNoMatch};
        const unsigned step = (code & compact::kHighBit) != 0 ? unsigned{kDepthStep} : 0U;
        return code == ViewPoints::kNoEdge ? none : step;
    };
    for (int c = 1; c + 1 < in.width; ++c) {
        const unsigned bits = look(in.right[c], c + 1 < in.firstColumn) |
                              look(in.down[c], c < in.firstColumn) |
                              look(in.right[c - 1], c - 1 < in.firstColumn) |
                              look(in.downAbove[c], c < in.firstColumn);
        in.kinds[c] = static_cast<std::uint8_t>(in.z[c] > 0 ? bits : 0U);
    }
}

}  // namespace
}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap {

HWY_EXPORT(depthsOf);
HWY_EXPORT(fitPatches);
HWY_EXPORT(anglesOf);
HWY_EXPORT(areasOf);
HWY_EXPORT(looksOf);
HWY_EXPORT(edgesOf);
HWY_EXPORT(kindsOf);

std::size_t depthsOfRow(const DepthRow& row) {
    return HWY_DYNAMIC_DISPATCH(depthsOf)(row);
}
void fitPatchRow(const PatchRow& row) {
    HWY_DYNAMIC_DISPATCH(fitPatches)(row);
}
void anglesOfRow(const AngleRow& row, std::uint8_t* onPlane) {
    HWY_DYNAMIC_DISPATCH(anglesOf)(row, onPlane);
}
void areasOfRow(const AngleRow& row) {
    HWY_DYNAMIC_DISPATCH(areasOf)(row);
}
void looksOfRow(const LookRow& row) {
    HWY_DYNAMIC_DISPATCH(looksOf)(row);
}
void edgesOfRow(const EdgeRow& row) {
    HWY_DYNAMIC_DISPATCH(edgesOf)(row);
}
void kindsOfRow(const KindRow& row) {
    HWY_DYNAMIC_DISPATCH(kindsOf)(row);
}

}  // namespace riftmap
#endif
