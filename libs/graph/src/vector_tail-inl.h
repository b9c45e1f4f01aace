// SPDX-License-Identifier: BSD-3-Clause
// The ends of rows that are no whole vector. Highway's masked loads and stores want aligned
// addresses on old instruction sets, and may touch what lies behind. Included once for each
// instruction set.
#if defined(RIFTMAP_VECTOR_TAIL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RIFTMAP_VECTOR_TAIL_INL_H
#undef RIFTMAP_VECTOR_TAIL_INL_H
#else
#define RIFTMAP_VECTOR_TAIL_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <array>

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {

/// `left` values, or a vector if there are more; zeros behind them.
template <class D>
HWY_INLINE hwy::HWY_NAMESPACE::Vec<D> loadSome(D d, const hwy::HWY_NAMESPACE::TFromD<D>* from,
                                               int left) {
    namespace hn = hwy::HWY_NAMESPACE;
    if (left >= static_cast<int>(hn::Lanes(d))) {
        return hn::LoadU(d, from);
    }
    std::array<hn::TFromD<D>, hn::MaxLanes(D())> buffer{};
    std::copy_n(from, std::max(left, 0), buffer.data());
    return hn::LoadU(d, buffer.data());
}

/// Stores the first `left` lanes, or all if there are fewer.
template <class D>
HWY_INLINE void storeSome(hwy::HWY_NAMESPACE::Vec<D> v, D d, hwy::HWY_NAMESPACE::TFromD<D>* to,
                          int left) {
    namespace hn = hwy::HWY_NAMESPACE;
    if (left >= static_cast<int>(hn::Lanes(d))) {
        hn::StoreU(v, d, to);
        return;
    }
    std::array<hn::TFromD<D>, hn::MaxLanes(D())> buffer;
    hn::StoreU(v, d, buffer.data());
    std::copy_n(buffer.data(), std::max(left, 0), to);
}

}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
