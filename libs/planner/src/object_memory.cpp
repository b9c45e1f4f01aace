// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/object_memory.h"

#include <algorithm>

namespace riftmap {

void PromiseKept::note(double promised, double came, double least) {
    constexpr double kFade = 0.5;  // the last few views count
    if (promised <= 0 || promised < 0.25 * least) {
        return;
    }
    promised_ = kFade * promised_ + promised;
    came_ = kFade * came_ + std::min(came, most_ * promised);
    share_ = std::clamp((came_ + 0.5 * least) / (promised_ + 0.5 * least), 0.05, most_);
}

void ObjectMemory::update(const SurfaceSummary& summary, double minGain) {
    const double came = summary.newArea();
    const double ofNew = frontierGain + tearGain;
    if (ofNew > 0 && ofNew >= 0.25 * minGain) {
        // As they were promised, so they are taken to have come.
        frontier.note(frontierGain / frontier.share(), came / ofNew * frontierGain, minGain);
        tears.note(tearGain / tears.share(), came / ofNew * tearGain, minGain);
    }
    doubt.note(doubtGain / doubt.share(), std::max(0.0, came - ofNew), minGain);
}

}  // namespace riftmap
