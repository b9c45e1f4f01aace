// SPDX-License-Identifier: BSD-3-Clause
#include "match_kernel.h"

#include <cstddef>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "match_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// The search of one pixel; the best of each lane until the end.
template <class D, class DI>
class Search {
 public:
    using V = hn::Vec<D>;
    using VI = hn::Vec<DI>;

    HWY_INLINE Search(const MatchRow& in, int column) : in_(in), column_(column) {
        const float depth = in.depth[column];
        const float perPixel = depth * in.footprint;
        const Gate gate = gateOf(in.gamma, perPixel, in.sigma[column], in.stretch[column]);
        const float pixels = perPixel / gate.lateral;
        lateralScale_ = pixels * pixels;
        radius_ = static_cast<int>(gate.lateral / perPixel + 0.5F) + 1;
        x_ = hn::Set(d_, static_cast<float>(column));
        y_ = hn::Set(d_, static_cast<float>(in.row));
        z_ = hn::Set(d_, depth);
        scale_ = hn::Set(d_, lateralScale_);
        leastAlong_ = hn::Set(d_, gate.depth * gate.depth);
        const float noise = kNoiseGate * in.sigma[column];
        noise_ = hn::Set(d_, noise * noise);
        best_ = hn::Set(d_, std::numeric_limits<float>::infinity());
        who_ = hn::Set(di_, -1);
    }

    /// Squares of growing size: a square's row of pixels is one run of entries, so the pixels
    /// looked at again cost less than a ring's many pieces.
    HWY_INLINE void run() {
        for (int half = 1;; half = half * 3 < radius_ ? half * 3 : radius_) {
            for (int r = in_.row - half; r <= in_.row + half; ++r) {
                look(r, column_ - half, column_ + half);
            }
            if (half >= radius_ || enough(half + 1)) {
                return;
            }
        }
    }

    HWY_INLINE void result(float& distance, std::int32_t& found) const {
        const V least = hn::MinOfLanes(d_, best_);
        distance = hn::GetLane(least);
        const VI last = hn::Set(di_, std::numeric_limits<std::int32_t>::max());
        const auto isBest = hn::RebindMask(di_, hn::Eq(best_, least));
        const std::int32_t who =
            hn::GetLane(hn::MinOfLanes(di_, hn::IfThenElse(isBest, who_, last)));
        found = distance < std::numeric_limits<float>::infinity() ? who : -1;
    }

 private:
    /// Nothing `pixels` away or farther can be nearer than what was found.
    HWY_INLINE bool enough(int pixels) const {
        const float nearest = static_cast<float>(pixels) - 0.5F;
        const float least = hn::GetLane(hn::MinOfLanes(d_, best_));
        return nearest * nearest * lateralScale_ > least;
    }

    /// Pixels [first, last] of a row of the image.
    HWY_INLINE void look(int r, int first, int last) {
        first = first < 0 ? 0 : first;
        last = last < in_.width ? last : in_.width - 1;
        if (r < 0 || r >= in_.height || first > last) {
            return;
        }
        const std::size_t line =
            static_cast<std::size_t>(r) * static_cast<std::size_t>(in_.width + 1);
        const std::size_t end = in_.start[line + static_cast<std::size_t>(last) + 1];
        for (std::size_t e = in_.start[line + static_cast<std::size_t>(first)]; e < end;
             e += hn::Lanes(d_)) {
            const V du = hn::Sub(hn::LoadU(d_, in_.u + e), x_);
            const V dv = hn::Sub(hn::LoadU(d_, in_.v + e), y_);
            const V dz = hn::Sub(hn::LoadU(d_, in_.z + e), z_);
            const V lateral = hn::Mul(hn::Add(hn::Mul(du, du), hn::Mul(dv, dv)), scale_);
            const V along = hn::Max(leastAlong_, hn::Add(noise_, hn::LoadU(d_, in_.noise + e)));
            const V behind = hn::Mul(dz, dz);
            const V distance =
                hn::Add(lateral, hn::Mul(hn::Set(d_, kDepthShare), hn::Div(behind, along)));
            const VI who = hn::LoadU(di_, in_.candidate + e);
            const auto inGate = hn::And(hn::Le(lateral, hn::Set(d_, 1.0F)), hn::Le(behind, along));
            const auto tie =
                hn::And(hn::Eq(distance, best_), hn::RebindMask(d_, hn::Lt(who, who_)));
            const auto better = hn::And(hn::And(inGate, hn::FirstN(d_, end - e)),
                                        hn::Or(hn::Lt(distance, best_), tie));
            best_ = hn::IfThenElse(better, distance, best_);
            who_ = hn::IfThenElse(hn::RebindMask(di_, better), who, who_);
        }
    }

    static constexpr D d_{};
    static constexpr DI di_{};
    const MatchRow& in_;
    int column_, radius_ = 0;
    float lateralScale_ = 0;
    V x_, y_, z_, scale_, leastAlong_, noise_, best_;
    VI who_;
};

void matchRowOf(const MatchRow& in) {
    // More than 8 lanes would stay empty: the three pixels of a row hold about three vertices.
    using D = hn::CappedTag<float, 8>;
    using DI = hn::CappedTag<std::int32_t, 8>;
    for (int c = 0; c < in.width; ++c) {
        in.found[c] = -1;
        if (in.depth[c] > 0) {
            Search<D, DI> search(in, c);
            search.run();
            search.result(in.distance[c], in.found[c]);
        }
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
