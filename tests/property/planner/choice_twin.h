// SPDX-License-Identifier: BSD-3-Clause
// What the tests may call of a plan.
#pragma once

#include <optional>
#include <vector>

#include "view_choice.h"

namespace riftmap {

struct ChoiceTwin {
    static std::optional<Eigen::Vector3d> lookOut(const Choice& choice, const RiftRecord& record,
                                                  const Eigen::Vector3d& out) {
        return choice.lookOut(record, out, false);
    }
    static bool mayBeSeen(const Choice& choice, const RiftRecord& record) {
        return choice.mayBeSeen(record);
    }
    static std::vector<Candidate> allInSight(Choice& choice, const RiftRecord& record,
                                             std::size_t most) {
        choice.candidates_.clear();
        choice.addAllInSight(record, most);
        return choice.candidates_;
    }
    static void giveUpHidden(Choice& choice, const RiftRecord& record) {
        choice.giveUp(record, true, false);
    }
    static std::optional<ViewPlan> lastResorts(Choice& choice) { return choice.lastResorts(); }

    static std::vector<Candidate>& candidates(Choice& choice) { return choice.candidates_; }
    static void addTurns(Choice& choice) { choice.addTurns(); }
    static void addPlaces(Choice& choice) { choice.addPlaces(); }
    static void score(Choice& choice) { choice.scoreFrom(0); }
    static void climb(Choice& choice) { choice.climb(); }
    static void keepPool(Choice& choice) { choice.keepPool(); }
    static std::vector<std::size_t> bestApart(const Choice& choice, std::size_t most) {
        return choice.bestApart(most, [](const Candidate& c) { return c.utility; });
    }
};

}  // namespace riftmap
