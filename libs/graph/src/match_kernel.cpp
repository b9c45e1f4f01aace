// SPDX-License-Identifier: BSD-3-Clause
#include "match_kernel.h"

#include <algorithm>
#include <cstddef>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "match_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "vector_tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
// Neighbours look at much the same entries: eight pixels at the ten columns around them.
using D = hn::CappedTag<float, 8>;
using DI = hn::Rebind<std::int32_t, D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
using M = hn::Mask<D>;
constexpr D d;
constexpr DI di;

HWY_INLINE V set(float x) {
    return hn::Set(d, x);
}
HWY_INLINE int lanes() {
    return static_cast<int>(hn::Lanes(d));
}

/// The search of a vector of pixels, one a lane.
class Search {
 public:
    HWY_INLINE Search(const MatchRow& in, int first) : in_(in), first_(first) {
        const int left = in.width - first;
        const V depth = loadSome(d, in.depth + first, left);
        const V deviation = loadSome(d, in.sigma + first, left);
        const V stretch = loadSome(d, in.stretch + first, left);
        const V gamma = set(in.gamma), one = set(1.0F);
        there_ = hn::Gt(depth, hn::Zero(d));
        // gateOf
        const V perPixel = hn::IfThenElse(there_, hn::Mul(depth, set(in.footprint)), one);
        const V blur = hn::Mul(set(kBlur), perPixel);
        const V lateral = hn::Max(gamma, blur);
        const V noise = hn::Mul(set(kNoiseGate), deviation);
        const V along = hn::Max(hn::Max(gamma, noise), hn::Mul(blur, hn::Max(one, stretch)));

        const V pixels = hn::Div(perPixel, lateral);
        scale_ = hn::Mul(pixels, pixels);
        const VI whole = hn::ConvertTo(di, hn::Add(hn::Div(lateral, perPixel), set(0.5F)));
        const VI radius =
            hn::Add(hn::Min(whole, hn::Set(di, in.width + in.height)), hn::Set(di, 1));
        radius_ = hn::IfThenElseZero(hn::RebindMask(di, there_), radius);
        x_ = hn::Add(set(static_cast<float>(first)), hn::Iota(d, 0));
        y_ = set(static_cast<float>(in.row));
        // Nothing is near to what is not there.
        z_ = hn::IfThenElse(there_, depth, set(std::numeric_limits<float>::quiet_NaN()));
        leastAlong_ = hn::Mul(along, along);
        noise_ = hn::Mul(noise, noise);
        best_ = set(std::numeric_limits<float>::infinity());
        who_ = hn::Set(di, -1);
    }

    /// Squares of growing size, as long as some pixel may find a nearer entry farther off.
    HWY_INLINE void run() {
        if (hn::AllFalse(d, there_)) {
            return;
        }
        for (int half = 1;;) {
            for (int r = in_.row - half; r <= in_.row + half; ++r) {
                look(r, first_ - half, first_ + lanes() - 1 + half);
            }
            const VI left = hn::IfThenElseZero(hn::RebindMask(di, unsure(half + 1)), radius_);
            const int most = hn::GetLane(hn::MaxOfLanes(di, left));
            if (most <= half) {
                return;
            }
            half = std::min(3 * half, most);
        }
    }

    HWY_INLINE void store(float* distance, std::int32_t* found, int left) const {
        storeSome(best_, d, distance, left);
        storeSome(who_, di, found, left);
    }

 private:
    /// Where an entry `pixels` away may still be nearer than what was found.
    HWY_INLINE M unsure(int pixels) const {
        const float nearest = static_cast<float>(pixels) - 0.5F;
        return hn::Le(hn::Mul(set(nearest * nearest), scale_), best_);
    }

    /// Pixels [first, last] of a row of the image.
    HWY_INLINE void look(int r, int first, int last) {
        first = std::max(first, 0);
        last = std::min(last, in_.width - 1);
        if (r < 0 || r >= in_.height) {
            return;
        }
        const std::size_t line =
            static_cast<std::size_t>(r) * static_cast<std::size_t>(in_.width + 1);
        const MatchEntry* end = in_.entries + in_.start[line + static_cast<std::size_t>(last) + 1];
        const MatchEntry* e = in_.entries + in_.start[line + static_cast<std::size_t>(first)];
        for (; e != end; ++e) {
            const V du = hn::Sub(set(e->u), x_);
            const V dv = hn::Sub(set(e->v), y_);
            const V dz = hn::Sub(set(e->z), z_);
            const V lateral = hn::Mul(hn::Add(hn::Mul(du, du), hn::Mul(dv, dv)), scale_);
            const V along = hn::Max(leastAlong_, hn::Add(noise_, set(e->noise)));
            const V behind = hn::Mul(dz, dz);
            const V distance = hn::Add(lateral, hn::Mul(set(kDepthShare), hn::Div(behind, along)));
            const VI who = hn::Set(di, e->candidate);
            const M inGate = hn::And(hn::Le(lateral, set(1.0F)), hn::Le(behind, along));
            const M tie = hn::And(hn::Eq(distance, best_), hn::RebindMask(d, hn::Lt(who, who_)));
            const M better = hn::And(inGate, hn::Or(hn::Lt(distance, best_), tie));
            best_ = hn::IfThenElse(better, distance, best_);
            who_ = hn::IfThenElse(hn::RebindMask(di, better), who, who_);
        }
    }

    const MatchRow& in_;
    int first_;
    M there_;
    V x_, y_, z_, scale_, leastAlong_, noise_, best_;
    VI radius_, who_;
};

void matchRowOf(const MatchRow& in) {
    for (int c = 0; c < in.width; c += lanes()) {
        Search search(in, c);
        search.run();
        search.store(in.distance + c, in.found + c, in.width - c);
    }
}

}  // namespace
}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace riftmap {

HWY_EXPORT(matchRowOf);

void matchRow(const MatchRow& row) {
    HWY_DYNAMIC_DISPATCH(matchRowOf)(row);
}

}  // namespace riftmap
#endif
