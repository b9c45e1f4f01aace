// SPDX-License-Identifier: BSD-3-Clause
// Rifts followed from view to view, against a slow twin that goes by the words of the header.
#include "riftmap/planner/rift_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

namespace riftmap {
namespace {

constexpr double kCell = 0.1;

using Index = std::array<int, 3>;
/// State of each torn cell of a made-up world.
using Tears = std::map<Index, RiftState>;

std::uint64_t keyOf(const Index& i) {
    return SurfaceSummary::keyAt({i[0], i[1], i[2]});
}

using Records = std::map<std::uint64_t, RiftRecord>;
using Changed = std::vector<const RiftRecord*>;

/// The ledger never forgets: what was torn and is no more is resolved. Returns the records of
/// which the state has changed.
Changed write(const Tears& tears, Records& records) {
    std::map<std::uint64_t, RiftState> before;
    for (auto& [key, record] : records) {
        before[key] = record.state;
        record.state = RiftState::kResolved;
        record.reason = "closed";
    }
    for (const auto& [index, state] : tears) {
        const auto [it, isNew] = records.try_emplace(keyOf(index));
        RiftRecord& r = it->second;
        r.state = state;
        r.reason = std::string("is ") + nameOf(state);
        r.cell.key = keyOf(index);
        r.cell.open = 3;
        if (isNew) {
            r.cell.rim = 0.05F;
        }
        r.cell.openPosition =
            (Eigen::Vector3f(static_cast<float>(index[0]), static_cast<float>(index[1]),
                             static_cast<float>(index[2])) +
             Eigen::Vector3f::Constant(0.5F)) *
            static_cast<float>(kCell);
    }
    Changed changed;
    for (const auto& [key, record] : records) {
        const auto was = before.find(key);
        if (was == before.end() || was->second != record.state) {
            changed.push_back(&record);
        }
    }
    return changed;
}

Tears row(int from, int to, RiftState state = RiftState::kOpen) {
    Tears tears;
    for (int x = from; x <= to; ++x) {
        tears[{x, 0, 0}] = state;
    }
    return tears;
}

Tears operator+(Tears a, const Tears& b) {
    a.insert(b.begin(), b.end());
    return a;
}

class RiftTrackerByHand : public testing::Test {
 protected:
    void see(const Tears& tears, const std::vector<Index>& aimedAt = {}) {
        const Changed changed = write(tears, records);
        std::vector<std::uint64_t> keys;
        for (const Index& i : aimedAt) {
            keys.push_back(keyOf(i));
        }
        tracker.update(view++, changed, keys);
    }
    const TrackedRift& rift(std::uint32_t id) const { return tracker.rifts().at(id); }
    std::size_t lastView(std::uint32_t id) const { return tracker.lastView(rift(id)); }
    std::uint32_t at(int x) const { return tracker.owners().at(keyOf({x, 0, 0})); }

    Records records;
    RiftTracker tracker{kCell};
    std::size_t view = 0;
};

TEST_F(RiftTrackerByHand, aRiftShrinksSplitsJoinsAndIsResolved) {
    see(row(-5, 4));
    EXPECT_EQ(at(0), 0U);
    EXPECT_NEAR(rift(0).extent, 1.0, 1e-9);
    EXPECT_NEAR(rift(0).rim, 0.5, 1e-6);
    EXPECT_EQ(rift(0).openVertices, 30U);
    see(row(-5, 3), {{4, 0, 0}});  // shrinks
    EXPECT_EQ(rift(0).cells.size(), 9U);
    see(row(-5, 0) + row(2, 3));  // splits
    EXPECT_EQ(at(-5), 0U);
    EXPECT_EQ(at(3), 1U);
    EXPECT_EQ(rift(1).parents, std::set<std::uint32_t>{0});
    EXPECT_EQ(rift(1).tries, std::set<std::size_t>{1});  // what was tried on the whole
    EXPECT_EQ(rift(1).firstView, 2U);
    see(row(-5, 0) + row(2, 9), {{2, 0, 0}});  // the younger one outgrows the older
    see(row(-5, 9));                           // they join: the older id stays
    EXPECT_EQ(at(9), 0U);
    EXPECT_FALSE(tracker.rifts().contains(1));
    EXPECT_EQ(rift(0).joined, std::set<std::uint32_t>{1});
    EXPECT_EQ(rift(0).tries, (std::set<std::size_t>{1, 3}));
    EXPECT_EQ(lastView(0), 4U);
    see({});
    EXPECT_EQ(rift(0).state, RiftState::kResolved);
    EXPECT_EQ(rift(0).reason, "closed");
    EXPECT_EQ(lastView(0), 4U);
    EXPECT_EQ(rift(0).cells.size(), 15U);
    see(row(0, 0));  // torn again
    EXPECT_EQ(at(0), 2U);
    EXPECT_TRUE(rift(2).parents.empty());
}

TEST_F(RiftTrackerByHand, cellsOfOneStateMakeARift) {
    see(row(0, 5) + row(6, 8, RiftState::kUnreachable));
    EXPECT_EQ(at(5), 0U);
    EXPECT_EQ(at(6), 1U);
    EXPECT_EQ(rift(1).reason, "is unreachable");
    see(row(0, 5, RiftState::kBelowResolution) + row(6, 8, RiftState::kUnreachable));
    EXPECT_EQ(at(5), 0U);  // given up as a whole, it stays the same rift
    EXPECT_EQ(rift(0).state, RiftState::kBelowResolution);
    see(row(0, 1, RiftState::kOpen) + row(2, 5, RiftState::kBelowResolution));
    EXPECT_EQ(at(0), 2U);
    EXPECT_EQ(rift(2).parents, std::set<std::uint32_t>{0});
    EXPECT_EQ(rift(1).state, RiftState::kResolved);
    const auto n = tracker.counts();
    EXPECT_EQ(n, (std::array<std::size_t, kRiftStates>{1, 0, 0, 0, 1, 1}));
}

TEST_F(RiftTrackerByHand, cornersTouchAndGapsDoNot) {
    see({{{0, 0, 0}, RiftState::kOpen},
         {{-1, 1, -1}, RiftState::kOpen},
         {{2, 0, 0}, RiftState::kOpen}});
    EXPECT_EQ(tracker.rifts().size(), 2U);
    EXPECT_EQ(at(0), tracker.owners().at(keyOf({-1, 1, -1})));
    EXPECT_NE(at(0), at(2));
    EXPECT_NEAR(rift(at(0)).extent, 0.2, 1e-9);
}

/// What was not told of is not looked at: time goes with what a view changed.
TEST_F(RiftTrackerByHand, farRiftsAreLeftAlone) {
    see(row(-5, -3) + row(2, 4));
    const double rim = rift(at(4)).rim;
    records.at(keyOf({4, 0, 0})).cell.rim = 7;
    see(row(-5, -2) + row(2, 4));
    EXPECT_EQ(rift(at(-2)).cells.size(), 4U);
    EXPECT_EQ(rift(at(4)).rim, rim);
    EXPECT_EQ(lastView(at(4)), 1U);
    see(row(-5, -2) + row(2, 5));
    EXPECT_GT(rift(at(4)).rim, 7.0);
}

TEST_F(RiftTrackerByHand, aRiftIsDescribedByItsCells) {
    Tears tears = row(0, 1);
    write(tears, records);
    for (const int x : {0, 1}) {
        SurfaceCell& cell = records.at(keyOf({x, 0, 0})).cell;
        cell.kinds = x == 0 ? kNoMatch : kDepthStep;
        cell.coarse = 0.25F;
        cell.highEdges = 2;
        cell.openNormal = Eigen::Vector3f(x == 0 ? 1.0F : -1.0F, 0, 1);
    }
    tracker.update(0, {&records.at(keyOf({0, 0, 0})), &records.at(keyOf({1, 0, 0}))}, {});
    EXPECT_EQ(rift(0).kinds, kNoMatch | kDepthStep);
    EXPECT_EQ(rift(0).coarse, 0.5);
    EXPECT_EQ(rift(0).highEdges, 4U);
    EXPECT_EQ(rift(0).normal, Eigen::Vector3f(0, 0, 1));
}

TEST_F(RiftTrackerByHand, theCentreLiesInTheTear) {
    Tears ring;
    for (int x = -3; x <= 3; ++x) {
        for (int y = -3; y <= 3; ++y) {
            if (std::max(std::abs(x), std::abs(y)) == 3) {
                ring[{x, y, 0}] = RiftState::kOpen;
            }
        }
    }
    see(ring);
    EXPECT_GT(rift(0).centre.head<2>().cwiseAbs().maxCoeff(), 0.2F);
}

/// The words of the header, taken one by one.
class SlowTracker {
 public:
    struct Life {
        std::set<Index> cells;
        std::set<std::uint32_t> parents, joined;
        bool gone = false;
    };

    void update(const Tears& tears) {
        const std::vector<std::set<Index>> groups = groupsOf(tears);
        std::vector<std::set<std::uint32_t>> heirTo(groups.size());
        for (const auto& [id, life] : lives) {
            std::size_t best = groups.size();
            std::size_t most = 0;
            for (std::size_t g = 0; g < groups.size() && !life.gone; ++g) {
                const std::size_t n = common(life.cells, groups[g]);
                if (n > most) {
                    most = n;
                    best = g;
                }
            }
            if (best < groups.size()) {
                heirTo[best].insert(id);
            }
        }
        std::map<std::uint32_t, Life> next = lives;
        for (auto& [id, life] : next) {
            life.gone = true;
        }
        for (std::size_t g = 0; g < groups.size(); ++g) {
            if (heirTo[g].empty()) {
                Life fresh;
                for (const auto& [id, life] : lives) {
                    if (!life.gone && common(life.cells, groups[g]) > 0) {
                        fresh.parents.insert(id);
                    }
                }
                fresh.cells = groups[g];
                next[nextId++] = fresh;
                continue;
            }
            Life& kept = next[*heirTo[g].begin()];
            kept.gone = false;
            kept.cells = groups[g];
            for (const std::uint32_t other : heirTo[g]) {
                if (other != *heirTo[g].begin()) {
                    kept.joined.insert(other);
                    kept.joined.insert(lives[other].joined.begin(), lives[other].joined.end());
                    next.erase(other);
                }
            }
        }
        lives = next;
    }

    std::map<std::uint32_t, Life> lives;
    std::uint32_t nextId = 0;

 private:
    static std::size_t common(const std::set<Index>& a, const std::set<Index>& b) {
        return static_cast<std::size_t>(
            std::count_if(a.begin(), a.end(), [&](const Index& i) { return b.contains(i); }));
    }
    /// Grown one cell at a time; in the order of their first keys.
    static std::vector<std::set<Index>> groupsOf(const Tears& tears) {
        std::vector<std::set<Index>> groups;
        std::set<Index> done;
        for (const auto& [seed, state] : tears) {
            if (done.contains(seed)) {
                continue;
            }
            std::set<Index> group{seed};
            for (bool grown = true; grown;) {
                grown = false;
                for (const auto& [index, other] : tears) {
                    const Index& cell = index;
                    const bool touches =
                        std::any_of(group.begin(), group.end(), [&](const Index& i) {
                            return std::abs(i[0] - cell[0]) <= 1 && std::abs(i[1] - cell[1]) <= 1 &&
                                   std::abs(i[2] - cell[2]) <= 1;
                        });
                    grown = (other == state && touches && group.insert(cell).second) || grown;
                }
            }
            done.insert(group.begin(), group.end());
            groups.push_back(group);
        }
        const auto first = [](const std::set<Index>& group) {
            std::uint64_t least = ~std::uint64_t{0};
            for (const Index& i : group) {
                least = std::min(least, keyOf(i));
            }
            return least;
        };
        std::sort(groups.begin(), groups.end(),
                  [&](const auto& a, const auto& b) { return first(a) < first(b); });
        return groups;
    }
};

class RiftTrackerAtRandom : public testing::TestWithParam<std::uint32_t> {};

TEST_P(RiftTrackerAtRandom, followsAsTheSlowTwinDoes) {
    SCOPED_TRACE("seed " + std::to_string(GetParam()));
    std::mt19937 random(GetParam());
    const auto below = [&](std::uint32_t n) { return static_cast<int>(random() % n); };
    RiftTracker tracker(kCell);
    SlowTracker slow;
    Records records;
    Tears tears;
    std::size_t splits = 0;
    std::size_t joins = 0;
    for (std::size_t view = 0; view < 25; ++view) {
        for (int i = 0; i < 30; ++i) {  // cells tear, close and change their minds
            const Index cell{below(9) - 4, below(9) - 4, below(3) - 1};
            if (below(5) < 2) {
                tears.erase(cell);
            } else {
                tears[cell] = below(6) == 0 ? RiftState::kUnreachable : RiftState::kOpen;
            }
        }
        Changed changed = write(tears, records);
        for (auto& [key, record] : records) {  // and others in length only
            if (below(8) == 0) {
                record.cell.rim = 0.01F * static_cast<float>(below(10));
                if (std::find(changed.begin(), changed.end(), &record) == changed.end()) {
                    changed.push_back(&record);
                }
            }
        }
        std::shuffle(changed.begin(), changed.end(), random);
        tracker.update(view, changed, {});
        slow.update(tears);
        ASSERT_EQ(tracker.rifts().size(), slow.lives.size());
        std::array<std::size_t, kRiftStates> counts{};
        std::map<std::uint32_t, int> told;  // every id once
        for (const auto& [id, life] : slow.lives) {
            ASSERT_TRUE(tracker.rifts().contains(id)) << id;
            const TrackedRift& rift = tracker.rifts().at(id);
            EXPECT_EQ(rift.state == RiftState::kResolved, life.gone) << id;
            EXPECT_EQ(rift.parents, life.parents) << id;
            EXPECT_EQ(rift.joined, life.joined) << id;
            std::vector<std::uint64_t> keys;
            for (const Index& cell : life.cells) {
                keys.push_back(keyOf(cell));
                if (!life.gone) {
                    EXPECT_EQ(tracker.owners().at(keyOf(cell)), id);
                    EXPECT_EQ(rift.state, tears.at(cell));
                }
            }
            std::sort(keys.begin(), keys.end());
            std::vector<std::uint64_t> cells;
            double rim = 0;
            for (const RiftRecord* cell : rift.cells) {
                cells.push_back(cell->cell.key);
                rim += static_cast<double>(cell->cell.rim);
            }
            EXPECT_EQ(cells, keys) << id;
            if (!life.gone) {
                EXPECT_EQ(rift.rim, rim) << id;
                EXPECT_EQ(tracker.lastView(rift), view) << id;
                EXPECT_EQ(rift.reason, std::string("is ") + nameOf(rift.state)) << id;
            }
            ++counts[static_cast<std::size_t>(rift.state)];
            ++told[id];
            for (const std::uint32_t other : rift.joined) {
                ++told[other];
            }
            splits += life.parents.size();
            joins += life.joined.size();
        }
        EXPECT_EQ(tracker.counts(), counts);
        EXPECT_EQ(tracker.owners().size(), tears.size());
        ASSERT_EQ(told.size(), slow.nextId);
        for (const auto& [id, times] : told) {
            EXPECT_EQ(times, 1) << id;
        }
    }
    EXPECT_GT(splits, 0U);
    EXPECT_GT(joins, 0U);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RiftTrackerAtRandom, testing::Range(1U, 9U));

}  // namespace
}  // namespace riftmap
