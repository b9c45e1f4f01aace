// SPDX-License-Identifier: BSD-3-Clause
// What is left when no candidate is worth a view: tears one by one, each from where it can be seen.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <unordered_map>

#include "riftmap/core/parallel.h"
#include "view_choice.h"

namespace riftmap {

bool Choice::lineOfSight(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) const {
    const Eigen::Vector3d way = target - eye;
    const double stop = way.norm() - 2.0 * k_.space().voxelSize();
    const double step = 0.7 * k_.space().voxelSize();
    for (double s = step; s < stop; s += step) {
        if (k_.space().at(eye + way.normalized() * s) == FreeSpace::State::kSurface) {
            return false;
        }
    }
    return true;
}

/// The first place along a line out of a tear from where it can be seen: within the range, not
/// tried, no vertex of the map within half the resolution of the line to it, and known to be
/// reachable, or with `anywhere` no more than free.
std::optional<Eigen::Vector3d> Choice::lookOut(const RiftRecord& record, const Eigen::Vector3d& out,
                                               bool anywhere) const {
    const Eigen::Vector3d p = record.cell.openPosition.cast<double>();
    const double resolution = k_.resolution();
    const double nearest = 1.02 * k_.sensor().nearLimit;
    const double stride = std::max(resolution, 0.5 * k_.space().voxelSize());
    const auto freeAt = [&](const Eigen::Vector3d& at) {
        return k_.space().at(at) == FreeSpace::State::kFree;
    };
    const auto mayLook = [&](const Eigen::Vector3d& at) {
        return (anywhere ? k_.mayBeAt(at) : std::isfinite(k_.space().distanceTo(at))) &&
               !RiftLedger::tried(record, at);
    };
    // The place first: most lines lead to none, and what is in the way takes longer to tell.
    const double first = 3 * resolution;
    double place = first;
    for (; place < k_.sensor().farLimit; place += freeAt(p + place * out) ? stride : resolution) {
        if (place > nearest && mayLook(p + place * out)) {
            break;
        }
    }
    if (place >= k_.sensor().farLimit) {
        return std::nullopt;
    }
    for (double s = first; s <= place;) {
        const Eigen::Vector3d at = p + s * out;
        const bool free = freeAt(at);
        if (!free && k_.graph().anyWithin(at.cast<float>(), static_cast<float>(0.5 * resolution))) {
            return std::nullopt;
        }
        s += free ? stride : resolution;
    }
    return p + place * out;
}

/// Calls f(eye) for places from where a tear can be seen, found by looking out of it along so many
/// directions to all sides, until f says false.
template <int kDirections, class F>
void Choice::forEachInSight(const RiftRecord& record, bool anywhere, const F& f) const {
    constexpr double kFacing = 0.2;  // cosine: surface seen at a flatter angle is not measured well
    // What it hides may face any way.
    const bool step = (record.cell.kinds & kDepthStep) != 0 || record.cell.hidden > 0;
    const Eigen::Vector3d normal = record.cell.openNormal.cast<double>();
    constexpr int kAtOnce = 40;
    constexpr int kApart = 247;
    static_assert(kDirections % kAtOnce == 0 && std::gcd(kDirections, kApart) == 1);
    std::array<std::optional<Eigen::Vector3d>, kAtOnce> eyes;
    for (int begin = 0; begin < kDirections; begin += kAtOnce) {
        parallelForEach(kAtOnce, 4, [&](int k) {
            // So that the first ones are from all sides, too.
            const int i = (begin + k) * kApart % kDirections;
            const Eigen::Vector3d out = evenDirection(i, kDirections);
            const bool faces = step || normal.isZero() || out.dot(normal) > kFacing;
            eyes.at(static_cast<std::size_t>(k)) =
                faces ? lookOut(record, out, anywhere) : std::nullopt;
        });
        for (const auto& eye : eyes) {
            if (eye && !f(*eye)) {
                return;
            }
        }
    }
}

/// Views of a tear from where it can be seen.
void Choice::addAllInSight(const RiftRecord& record, std::size_t most) {
    const std::size_t wanted = candidates_.size() + most;
    forEachInSight<400>(record, false, [&](const Eigen::Vector3d& eye) {
        add(eye, record.cell.openPosition.cast<double>());
        return candidates_.size() < wanted;
    });
}

/// Whether it can be seen from a free place that the camera may fit in, a way there known or not.
/// Asked before it is said that it cannot: in many directions, for slits are narrow.
bool Choice::mayBeSeen(const RiftRecord& record) const {
    const Eigen::Vector3d p = record.cell.openPosition.cast<double>();
    bool seen = false;
    forEachInSight<2000>(record, true, [&](const Eigen::Vector3d& eye) {
        seen = k_.tiltAllowed(k_.sensor().lookingAt(eye, p));
        return !seen;
    });
    return seen;
}

/// Whether the camera can be anywhere where this place is within its range.
bool Choice::inRange(const Eigen::Vector3d& place) {
    if (reachable_.empty()) {
        reachable_ = k_.space().reachable(1);
    }
    return std::any_of(reachable_.begin(), reachable_.end(), [&](const Eigen::Vector3d& eye) {
        const double distance = (eye - place).norm();
        return distance > k_.sensor().nearLimit && distance < k_.sensor().farLimit;
    });
}

void Choice::giveUp(const RiftRecord& record, bool reachable, bool visible) {
    const std::uint64_t key = record.cell.key;
    const std::string tries = std::to_string(record.attempts.size());
    const bool untried = !reachable || (!visible && record.attempts.empty());
    const bool torn = record.cell.rim > 0 || record.cell.hidden > 0;
    if (untried && mayBeSeen(record)) {
        // The camera may fit there, so it must not be said that no view can close it.
        k_.ledger().giveUp(key, RiftState::kDeferred,
                           "seen only from where the voxels of free space are too coarse to lead");
    } else if (!reachable) {
        k_.ledger().giveUp(key, RiftState::kUnreachable,
                           "no place within the range of it is known to be free");
    } else if (!visible && record.attempts.empty() && !torn) {
        k_.ledger().giveUp(key, RiftState::kBelowResolution,
                           "seen only from where it cannot be known as well as asked");
    } else if (!visible && record.attempts.empty()) {
        k_.ledger().giveUp(key, RiftState::kUnobservable,
                           "hidden from every place that can be reached");
    } else if (!visible) {
        k_.ledger().giveUp(key, RiftState::kBelowResolution,
                           "from all sides that see it views did not close it (" + tries +
                               "): finer than they resolve");
    } else {
        k_.ledger().giveUp(key, RiftState::kBelowResolution,
                           "no view of it would show enough to be worth taking");
    }
}

/// No candidate was worth it. Tears that are left get candidates of their own, from all sides; one
/// that even these do not help is given up, with the reason. Where thousands are left that no view
/// closes (plain walls) the largest speak for the others.
std::optional<ViewPlan> Choice::lastResorts() {
    std::vector<const RiftRecord*> left = scorer_.open();
    // A look takes 5 ms as a rule, but longer where many are open.
    const std::size_t most =
        std::min<std::size_t>(2000, 60000000 / std::max<std::size_t>(left.size(), 1));
    const double cell = k_.summary().cellSize();
    std::stable_sort(left.begin(), left.end(), [&](const RiftRecord* a, const RiftRecord* b) {
        return k_.ledger().tear(a->cell, cell) > k_.ledger().tear(b->cell, cell);
    });
    const double minGain = k_.minGain();
    // Views that show a tear, were weighed, and are not worth it, made for it or for others.
    constexpr std::size_t kViews = 12;
    std::unordered_map<std::uint64_t, std::size_t> shown;
    std::size_t count = 0;
    for (const RiftRecord* record : left) {
        if (record->state != RiftState::kOpen) {
            continue;
        }
        if (shown[record->cell.key] >= kViews) {
            giveUp(*record, true, true);
            continue;
        }
        if (++count > most) {
            k_.ledger().giveUp(record->cell.key, RiftState::kDeferred,
                               "not looked at by itself: no view of " + std::to_string(most) +
                                   " larger ones was worth taking");
            continue;
        }
        candidates_.clear();
        addAround(*record, 20);
        if (k_.surfaceBox()) {
            addInSight(*record, 60, 60);
        }
        const Eigen::Vector3d p = record->cell.openPosition.cast<double>();
        std::erase_if(candidates_, [&](const Candidate& c) {
            return scorer_.benefit(*record, c.pose).quality < 0.1 ||
                   !lineOfSight(c.pose.translation, p);
        });
        bool reachable = true;
        if (candidates_.empty()) {  // before it is said that there is none: from all sides
            addAllInSight(*record, kViews);
            reachable = !candidates_.empty() || inRange(p);
        }
        const bool visible = !candidates_.empty();
        for (Candidate& c : candidates_) {
            c.utility = scorer_.benefit(*record, c.pose).area;  // until it is scored
        }
        std::erase_if(candidates_, [](const Candidate& c) { return c.utility <= 0; });
        if (candidates_.size() > kViews) {
            std::stable_sort(
                candidates_.begin(), candidates_.end(),
                [](const Candidate& a, const Candidate& b) { return a.utility > b.utility; });
            candidates_.resize(kViews);
        }
        scoreFrom(0);
        for (const Candidate& c : candidates_) {
            if (c.score.gain < minGain) {
                for (const std::uint64_t key : c.score.cells) {
                    ++shown[key];
                }
            }
        }
        std::erase_if(candidates_, [&](const Candidate& c) {
            return c.score.nearShare > 0.3 || c.score.gain < minGain ||
                   !std::binary_search(c.score.cells.begin(), c.score.cells.end(),
                                       record->cell.key);
        });
        if (const Candidate* c = best()) {
            return planFor(*c);
        }
        giveUp(*record, reachable, visible);
    }
    return std::nullopt;
}

}  // namespace riftmap
