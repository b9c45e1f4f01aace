// SPDX-License-Identifier: BSD-3-Clause
// Masks of vectors as bits of a page's slots. Included once for each instruction set.
#if defined(RIFTMAP_SLOT_BITS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RIFTMAP_SLOT_BITS_INL_H
#undef RIFTMAP_SLOT_BITS_INL_H
#else
#define RIFTMAP_SLOT_BITS_INL_H
#endif

#include <hwy/highway.h>

#include <array>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace riftmap::HWY_NAMESPACE {

/// The lanes of the mask, 16 at most, as bits from slot `first` on.
template <class D>
HWY_INLINE std::uint64_t slotBits(D d, hwy::HWY_NAMESPACE::Mask<D> mask, std::uint32_t first) {
    std::array<std::uint8_t, 8> bytes{};
    hwy::HWY_NAMESPACE::StoreMaskBits(d, mask, bytes.data());
    return std::uint64_t{unsigned{bytes[0]} | (unsigned{bytes[1]} << 8U)} << first;
}

}  // namespace riftmap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
