// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/rift_ledger.h"

#include <algorithm>
#include <cmath>

namespace riftmap {

namespace {

std::string vainReason(const RiftRecord& record) {
    return std::to_string(record.attempts.size()) +
           " views of it did not close it: finer than they resolve";
}

}  // namespace

const char* nameOf(RiftState state) {
    constexpr std::array<const char*, kRiftStates> names = {
        "open", "deferred", "unreachable", "unobservable", "below_resolution", "resolved"};
    return names[static_cast<std::size_t>(state)];
}

RiftLedger::RiftLedger(double resolution, int maxAttempts)
    : resolution_(resolution), maxAttempts_(maxAttempts) {}

float RiftLedger::tear(const SurfaceCell& cell, double cellSize) const {
    return cell.rim * static_cast<float>(cellSize) + cell.coarse;
}

void RiftLedger::note(RiftRecord& record) {
    if (!record.changed) {
        record.changed = true;
        changed_.push_back(&record);
    }
}

void RiftLedger::setState(RiftRecord& record, RiftState state, const std::string& reason) {
    --counts_[static_cast<std::size_t>(record.state)];
    record.state = state;
    ++counts_[static_cast<std::size_t>(state)];
    record.reason = reason;
    note(record);
}

std::vector<const RiftRecord*> RiftLedger::takeChanged() {
    std::sort(changed_.begin(), changed_.end(),
              [](const RiftRecord* a, const RiftRecord* b) { return a->cell.key < b->cell.key; });
    for (RiftRecord* record : changed_) {
        record->changed = false;
    }
    std::vector<const RiftRecord*> taken(changed_.begin(), changed_.end());
    changed_.clear();
    return taken;
}

void RiftLedger::updateCell(const SurfaceCell& cell, double cellSize) {
    const bool torn = cell.open > 0;
    const bool large = static_cast<double>(cell.rim) >= 1.5 * resolution_ ||
                       static_cast<double>(cell.coarse) >= 0.15 * cellSize * cellSize;
    std::vector<RiftRecord*>& block = byBlock_[SurfaceSummary::blockOf(cell.key)];
    auto at = std::lower_bound(
        block.begin(), block.end(), cell.key,
        [](const RiftRecord* record, std::uint64_t key) { return record->cell.key < key; });
    if (at == block.end() || (*at)->cell.key != cell.key) {
        if (!torn) {
            return;
        }
        RiftRecord& fresh = records_[cell.key];
        fresh.cell.key = cell.key;
        ++counts_[static_cast<std::size_t>(fresh.state)];
        at = block.insert(at, &fresh);
    }
    RiftRecord& r = **at;
    if (!torn) {
        if (r.state != RiftState::kResolved) {
            setState(r, RiftState::kResolved, "closed");
        }
        return;
    }
    r.cell = cell;
    note(r);
    if (!large) {
        setState(r, RiftState::kBelowResolution, "shorter than the asked resolution");
        return;
    }
    const bool exhausted = static_cast<int>(r.attempts.size()) >= maxAttempts_;
    const bool givenUp = r.state == RiftState::kUnreachable ||
                         r.state == RiftState::kUnobservable || r.state == RiftState::kDeferred ||
                         exhausted;
    if (!givenUp) {
        setState(r, RiftState::kOpen, "");
    } else if (r.state == RiftState::kResolved) {  // torn again, though views of it were in vain
        setState(r, RiftState::kBelowResolution, vainReason(r));
    } else if (r.reconsidered < 2 && cell.vertices > r.verticesThen + r.verticesThen / 3 + 8) {
        // New surface came up beside it.
        ++r.reconsidered;
        setState(r, RiftState::kOpen, "");
        if (!r.attempts.empty()) {
            r.attempts.erase(r.attempts.begin());
        }
    }
}

void RiftLedger::update(const SurfaceSummary& summary) {
    for (const std::uint64_t blockKey : summary.changed()) {
        const auto it = summary.blocks().find(blockKey);
        if (it != summary.blocks().end()) {
            for (const SurfaceCell& cell : it->second.cells) {
                updateCell(cell, summary.cellSize());
            }
        }
        const auto torn = byBlock_.find(blockKey);
        if (torn == byBlock_.end()) {
            continue;
        }
        for (RiftRecord* r : torn->second) {
            if (r->state != RiftState::kResolved && summary.find(r->cell.key) == nullptr) {
                setState(*r, RiftState::kResolved, "seen through");
            }
        }
    }
}

std::span<const RiftRecord* const> RiftLedger::inBlock(std::uint64_t block) const {
    const auto it = byBlock_.find(block);
    return it == byBlock_.end() ? std::span<const RiftRecord* const>()
                                : std::span<const RiftRecord* const>(it->second);
}

std::vector<TriedTear> RiftLedger::tears(const std::vector<std::uint64_t>& keys,
                                         double cellSize) const {
    std::vector<TriedTear> tears;
    for (const std::uint64_t key : keys) {
        const auto it = records_.find(key);
        if (it != records_.end()) {
            tears.push_back({key, tear(it->second.cell, cellSize), it->second.cell.kinds});
        }
    }
    return tears;
}

void RiftLedger::judge(const SurfaceSummary& summary, const std::vector<TriedTear>& tried,
                       const Eigen::Vector3d& eye) {
    constexpr float kHelped = 0.75F;
    for (const TriedTear& before : tried) {
        const auto it = records_.find(before.key);
        if (it == records_.end()) {
            continue;
        }
        RiftRecord& r = it->second;
        const bool helped = r.state == RiftState::kResolved ||
                            tear(r.cell, summary.cellSize()) <= kHelped * before.size;
        if ((before.kinds & kNoMatch) != 0) {
            Tries& inBlock = unmatchedByBlock_[SurfaceSummary::blockOf(before.key)];
            for (Tries* t : {&unmatched_, &inBlock}) {
                ++t->all;
                t->helped += helped ? 1 : 0;
            }
        }
        if (helped || r.state != RiftState::kOpen) {
            continue;
        }
        const Eigen::Vector3f ray = eye.cast<float>() - r.cell.openPosition;
        r.attempts.push_back({ray.normalized(), ray.norm()});
        if (static_cast<int>(r.attempts.size()) >= maxAttempts_) {
            giveUp(before.key, RiftState::kBelowResolution, vainReason(r));
        }
    }
}

double RiftLedger::tryWorth(const RiftRecord& record) const {
    constexpr double kUsual = 0.5;
    constexpr double kBefore = 100;  // tries taken to be as usual
    constexpr double kBeforeInBlock = 10;
    if ((record.cell.kinds & kNoMatch) == 0) {
        return 1;
    }
    double share = (unmatched_.helped + kBefore * kUsual) / (unmatched_.all + kBefore);
    const auto it = unmatchedByBlock_.find(SurfaceSummary::blockOf(record.cell.key));
    if (it != unmatchedByBlock_.end()) {
        const Tries& here = it->second;
        share = (here.helped + kBeforeInBlock * share) / (here.all + kBeforeInBlock);
    }
    return std::min(1.0, share / kUsual);
}

void RiftLedger::giveUp(std::uint64_t key, RiftState state, const std::string& reason) {
    const auto it = records_.find(key);
    if (it != records_.end()) {
        setState(it->second, state, reason);
        it->second.verticesThen = it->second.cell.vertices;
    }
}

void RiftLedger::reopen(RiftState state) {
    for (auto& [key, r] : records_) {
        if (r.state == state) {
            setState(r, RiftState::kOpen, "");
        }
    }
}

void RiftLedger::deferOpen(const std::string& reason) {
    for (auto& [key, r] : records_) {
        if (r.state == RiftState::kOpen) {
            setState(r, RiftState::kDeferred, reason);
        }
    }
}

bool RiftLedger::tried(const RiftRecord& record, const Eigen::Vector3d& eye) {
    const Eigen::Vector3f ray = eye.cast<float>() - record.cell.openPosition;
    const float distance = ray.norm();
    return std::any_of(record.attempts.begin(), record.attempts.end(), [&](const Attempt& a) {
        constexpr float kCosSame = 0.92F;  // 23 degrees
        constexpr float kOver = 0.1F;
        // Farther over a silhouette the eye sees what it could not see before.
        const bool farther = (record.cell.kinds & kDepthStep) != 0 &&
                             ray.dot(record.cell.outward) >
                                 (a.direction.dot(record.cell.outward) + kOver) * distance;
        return !farther && ray.dot(a.direction) > kCosSame * distance &&
               distance > 0.7F * a.distance && distance < 1.4F * a.distance;
    });
}

}  // namespace riftmap
