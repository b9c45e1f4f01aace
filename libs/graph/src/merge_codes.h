// SPDX-License-Identifier: BSD-3-Clause
// The packed values of vertices and edges that merging changes, one by one.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "riftmap/graph/compact.h"
#include "riftmap/graph/graph_storage.h"

namespace riftmap {

/// Views in a row that saw through a vertex, kept in its state.
inline unsigned evidenceOf(std::uint8_t state) {
    return (state & kEvidenceMask) >> kEvidenceShift;
}
inline std::uint8_t withEvidence(std::uint8_t state, unsigned evidence) {
    return static_cast<std::uint8_t>((state & ~kEvidenceMask) |
                                     (std::min(evidence, 7U) << kEvidenceShift));
}

/// The weight code at `slot`; safe while others lower it.
inline std::uint16_t weightAt(std::uint16_t& slot) {
    return std::atomic_ref<std::uint16_t>(slot).load(std::memory_order_relaxed);
}

/// Lowers the weight code stored at `slot`; safe while others do the same. True if it changed.
inline bool lowerWeight(std::uint16_t& slot, std::uint16_t code) {
    std::atomic_ref<std::uint16_t> ref(slot);
    std::uint16_t old = ref.load(std::memory_order_relaxed);
    for (;;) {
        const std::uint16_t smaller = compact::smallerWeight(old, code);
        if (smaller == old) {
            return false;
        }
        if (ref.compare_exchange_weak(old, smaller, std::memory_order_relaxed)) {
            return true;
        }
    }
}

}  // namespace riftmap
