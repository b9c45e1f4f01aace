// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/rift_ledger.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <string>

#include "planner_scene.h"
#include "riftmap/planner/view_scorer.h"

namespace riftmap {
namespace {

/// A wall seen once: its rim is one long tear.
class LedgerOnWall : public testing::Test {
 protected:
    void SetUp() override { see(lookAt({0, 0, 0}, {1, 0, 0})); }

    void see(const Pose& pose, double wall = 2.0) {
        const View view = test::viewOf(pose, test::wall(wall));
        graph.merge(view);
        summary.update(graph, view);
        ledger.update(summary);
    }
    std::uint64_t anyOpen() const {
        for (const auto& [key, record] : ledger.records()) {
            if (record.state == RiftState::kOpen) {
                return key;
            }
        }
        return 0;
    }

    PixelGraph graph{test::graphOptions(0.05)};
    SurfaceSummary summary{0.2, 0.05};
    RiftLedger ledger{0.05, 3};
};

TEST_F(LedgerOnWall, theRimIsOpenAndTheMiddleIsNot) {
    EXPECT_GT(ledger.counts()[static_cast<std::size_t>(RiftState::kOpen)], 20U);
    for (const auto& [key, record] : ledger.records()) {
        const Eigen::Vector3f p = record.cell.openPosition;
        EXPECT_TRUE(std::abs(p.y()) > 0.9F || std::abs(p.z()) > 0.7F) << p.transpose();
        if (record.state == RiftState::kOpen) {  // the rim points outwards
            EXPECT_GT(record.cell.outward.dot(Eigen::Vector3f(0, p.y(), p.z())), 0.0F);
        }
    }
}

TEST_F(LedgerOnWall, whatIsCountedAlongTheWayIsWhatIsThere) {
    auto before = summary.blocks();
    for (const double y : {0.4, -0.9, 1.3}) {
        see(lookAt({-0.3 * y, y, 0.1}, {1, y, 0}));
        ASSERT_EQ(summary.former().size(), summary.changed().size());
        for (std::size_t i = 0; i < summary.changed().size(); ++i) {
            const auto it = before.find(summary.changed()[i]);
            const std::size_t cells = it == before.end() ? 0 : it->second.cells.size();
            EXPECT_EQ(summary.former()[i].cells.size(), cells);
        }
        std::size_t cells = 0;
        double coarse = 0;
        std::size_t open = 0;
        for (const auto& [key, block] : summary.blocks()) {
            cells += block.cells.size();
            ASSERT_EQ(block.positions.rows(), static_cast<Eigen::Index>(block.cells.size()));
            for (std::size_t i = 0; i < block.cells.size(); ++i) {
                EXPECT_EQ(block.positions.row(static_cast<Eigen::Index>(i)).transpose(),
                          block.cells[i].position);
                coarse += static_cast<double>(block.cells[i].coarse);
            }
            std::uint64_t last = 0;
            for (const RiftRecord* record : ledger.inBlock(key)) {
                EXPECT_EQ(&ledger.records().at(record->cell.key), record);
                EXPECT_GT(record->cell.key, last);
                last = record->cell.key;
                open += record->state == RiftState::kOpen ? 1 : 0;
            }
        }
        EXPECT_EQ(summary.cellCount(), cells);
        EXPECT_NEAR(summary.area(), 0.04 * static_cast<double>(cells), 1e-9);
        EXPECT_NEAR(summary.coarseArea(), coarse, 1e-6);
        EXPECT_EQ(ledger.counts()[static_cast<std::size_t>(RiftState::kOpen)], open);
        before = summary.blocks();
    }
}

TEST_F(LedgerOnWall, whatIsInfinitelyFarIsInNoBlock) {
    // Aslant, so that it is infinitely far along each axis, downwards too.
    View view = test::viewOf(lookAt({0, 0, 0}, {-1, -0.7, -0.4}),
                             [](const Eigen::Vector3d&, const Eigen::Vector3d& ray) {
                                 return std::optional(-1.0 / ray.x());  // the wall x = -1
                             });
    for (int row = 0; row < view.disparity.height; ++row) {
        for (int column = 0; column < view.disparity.width; ++column) {
            if ((row + column) % 20 < 10) {
                view.disparity.disparity[view.disparity.index(column, row)] = 0;
            }
        }
    }
    ASSERT_TRUE(view.disparity.valid(0, 0));
    ASSERT_TRUE(std::isinf(view.camera.depth(0.0)));
    graph.merge(view);
    summary.update(graph, view);
    EXPECT_GT(summary.changed().size(), 0U);
    EXPECT_LT(summary.changed().size(), 50U);
}

TEST_F(LedgerOnWall, aTearThatIsClosedIsResolved) {
    see(lookAt({0, 1, 0}, {1, 1, 0}));  // a metre to the left: its left rim is inside now
    std::size_t resolved = 0;
    for (const auto& [key, record] : ledger.records()) {
        const Eigen::Vector3f p = record.cell.openPosition;
        if (record.state == RiftState::kResolved) {
            EXPECT_GT(std::abs(p.y()), 0.0F);
            ++resolved;
        }
    }
    EXPECT_GT(resolved, 3U);
}

TEST_F(LedgerOnWall, vainTriesAreNotRepeatedAndEndTheTear) {
    const std::uint64_t key = anyOpen();
    const RiftRecord& record = ledger.records().at(key);
    const auto before = ledger.tears({key}, summary.cellSize());
    const Eigen::Vector3d p = record.cell.openPosition.cast<double>();
    const Eigen::Vector3d eye = p + Eigen::Vector3d(-1, 0, 0);
    EXPECT_FALSE(RiftLedger::tried(record, eye));
    ledger.judge(summary, before, eye);
    EXPECT_TRUE(RiftLedger::tried(record, eye));
    EXPECT_TRUE(RiftLedger::tried(record, eye + Eigen::Vector3d(0, 0.1, 0)));
    EXPECT_FALSE(RiftLedger::tried(record, p + Eigen::Vector3d(-1, 1, 0)));    // another side
    EXPECT_FALSE(RiftLedger::tried(record, p + Eigen::Vector3d(-0.4, 0, 0)));  // nearer
    ledger.judge(summary, before, p + Eigen::Vector3d(-1, 1, 0));
    EXPECT_EQ(record.state, RiftState::kOpen);
    ledger.judge(summary, before, p + Eigen::Vector3d(-1, -1, 0));
    EXPECT_EQ(record.state, RiftState::kBelowResolution);
    EXPECT_EQ(record.attempts.size(), 3U);
    EXPECT_FALSE(record.reason.empty());
}

TEST_F(LedgerOnWall, aTryThatHelpedIsNoAttempt) {
    const std::uint64_t key = anyOpen();
    const float tear = ledger.tear(ledger.records().at(key).cell, summary.cellSize());
    ledger.judge(summary, {{key, 4 * tear, kImageBorder}}, {0, 0, 0});
    EXPECT_TRUE(ledger.records().at(key).attempts.empty());
}

TEST_F(LedgerOnWall, triesInVainMakeOtherTearsWithoutAMatchWorthLess) {
    View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(2.0));
    for (int row = 0; row < view.camera.height; ++row) {  // a grid of plain squares on the wall
        for (int column = 0; column < view.camera.width; ++column) {
            if (column % 40 < 20 && row % 40 < 20) {
                view.disparity.disparity[view.disparity.index(column, row)] = kNoDisparity;
            }
        }
    }
    PixelGraph map(test::graphOptions(0.05));
    SurfaceSummary cells(0.1, 0.05);
    RiftLedger tears(0.05, 100);
    map.merge(view);
    cells.update(map, view);
    tears.update(cells);
    std::vector<std::uint64_t> unmatched;
    std::uint64_t border = 0;
    for (const auto& [key, record] : tears.records()) {
        EXPECT_EQ(tears.tryWorth(record), 1.0);
        if (record.state == RiftState::kOpen && (record.cell.kinds & kNoMatch) != 0) {
            unmatched.push_back(key);
        } else if (record.state == RiftState::kOpen) {
            border = key;
        }
    }
    ASSERT_GT(unmatched.size(), 40U);
    const auto near = [&](std::uint64_t key) {  // of the first one's block
        return SurfaceSummary::blockOf(key) == SurfaceSummary::blockOf(unmatched.front());
    };
    const auto worth = [&](std::uint64_t key) { return tears.tryWorth(tears.records().at(key)); };
    const std::uint64_t other = *std::find_if(unmatched.begin(), unmatched.end(),
                                              [&](std::uint64_t key) { return !near(key); });
    const auto judge = [&](std::uint64_t key, float before) {
        tears.judge(cells, {{key, before, kNoMatch}}, {0, 0, 0});
    };
    for (int i = 0; i < 20; ++i) {
        judge(unmatched.front(), 0);
    }
    EXPECT_LT(worth(unmatched.front()), 0.5);
    EXPECT_LT(worth(other), 1.0);  // a little
    EXPECT_GT(worth(other), 0.8);
    ASSERT_NE(border, 0U);
    EXPECT_EQ(worth(border), 1.0);
    for (int i = 0; i < 200; ++i) {
        judge(unmatched.front(), 1e9F);
    }
    EXPECT_EQ(worth(unmatched.front()), 1.0);
    EXPECT_EQ(worth(other), 1.0);
    // One that was given up was not closed; what it was before the view counts.
    tears.giveUp(other, RiftState::kDeferred, "no way there");
    for (int i = 0; i < 200; ++i) {
        tears.judge(cells, {{other, 0, kImageBorder}}, {0, 0, 0});
    }
    EXPECT_EQ(worth(other), 1.0);
    for (int i = 0; i < 200; ++i) {
        judge(other, 0);
    }
    EXPECT_LT(worth(other), 0.5);
    EXPECT_TRUE(tears.records().at(other).attempts.empty());
    EXPECT_EQ(worth(border), 1.0);
}

TEST_F(LedgerOnWall, whatWasUnreachableOpensAgainAndNothingElse) {
    const std::uint64_t key = anyOpen();
    ledger.giveUp(key, RiftState::kUnreachable, "no way there");
    ledger.reopen(RiftState::kUnobservable);
    EXPECT_EQ(ledger.records().at(key).state, RiftState::kUnreachable);
    ledger.reopen(RiftState::kUnreachable);
    EXPECT_EQ(ledger.records().at(key).state, RiftState::kOpen);
    EXPECT_TRUE(ledger.records().at(key).reason.empty());
}

TEST_F(LedgerOnWall, whatWasDeferredStaysSoUntilItIsReopened) {
    const std::uint64_t key = anyOpen();
    ledger.giveUp(key, RiftState::kDeferred, "no way there");
    ledger.update(summary);
    EXPECT_EQ(ledger.records().at(key).state, RiftState::kDeferred);
    ledger.reopen(RiftState::kDeferred);
    EXPECT_EQ(ledger.records().at(key).state, RiftState::kOpen);
}

TEST_F(LedgerOnWall, whatIsOpenAtTheEndIsDeferred) {
    ledger.deferOpen("max_views");
    EXPECT_EQ(ledger.counts()[static_cast<std::size_t>(RiftState::kOpen)], 0U);
    EXPECT_GT(ledger.counts()[static_cast<std::size_t>(RiftState::kDeferred)], 0U);
}

TEST_F(LedgerOnWall, whatIsWrittenIsToldAndCounted) {
    EXPECT_EQ(ledger.takeChanged().size(), ledger.records().size());
    const auto giveAllUp = [&](RiftState state) {
        for (const auto& [key, record] : ledger.records()) {
            if (record.state == RiftState::kOpen) {
                ledger.giveUp(key, state, "of no use");
            }
        }
    };
    const auto tryAllInVain = [&](const Eigen::Vector3d& eye) {
        for (const auto& [key, record] : ledger.records()) {
            ledger.judge(summary, ledger.tears({key}, summary.cellSize()), eye);
        }
    };
    const Pose left = lookAt({0, 1, 0}, {1, 1, 0});
    const Pose right = lookAt({0, -0.05, 0}, {1, -0.05, 0});
    const std::vector<std::function<void()>> writes = {
        [&] { giveAllUp(RiftState::kUnobservable); },
        [&] { see(left); },  // given up: described, reconsidered or closed
        [&] { ledger.reopen(RiftState::kUnobservable); },
        [&] {
            tryAllInVain({-0.2, -0.9, 0.1});
        },  // three are enough to give a tear up
        [&] {
            tryAllInVain({-0.2, 0.9, 0.1});
        },
        [&] {
            tryAllInVain({-0.2, 0.1, 0.9});
        },
        [&] {
            see(lookAt({0, 0.5, 0}, {1, 0.5, 0}));
        },
        [&] {
            see(lookAt({0, 1.5, 0}, {1, 1.5, 0}));
        },
        [&] { see(left, 2.1); },   // ends in a cell where the wall went on
        [&] { see(right, 4.0); },  // the wall is seen through: twice, and it is gone
        [&] { see(right, 4.0); },
        [&] { giveAllUp(RiftState::kUnreachable); },
        [&] { ledger.reopen(RiftState::kUnreachable); },
        [&] { ledger.deferOpen("max_views"); },
    };
    bool reconsidered = false;
    bool tornAgain = false;
    bool seenThrough = false;
    for (std::size_t i = 0; i < writes.size(); ++i) {
        SCOPED_TRACE("write " + std::to_string(i));
        const std::map<std::uint64_t, RiftRecord> before = ledger.records();
        writes[i]();
        const std::vector<const RiftRecord*> changed = ledger.takeChanged();
        EXPECT_TRUE(ledger.takeChanged().empty());
        for (std::size_t j = 1; j < changed.size(); ++j) {
            EXPECT_LT(changed[j - 1]->cell.key, changed[j]->cell.key);
        }
        std::array<std::size_t, kRiftStates> counts{};
        std::size_t written = 0;
        for (const auto& [key, now] : ledger.records()) {
            ++counts[static_cast<std::size_t>(now.state)];
            const auto it = before.find(key);
            const bool same =
                it != before.end() && it->second.state == now.state &&
                it->second.reason == now.reason && it->second.cell.open == now.cell.open &&
                it->second.cell.kinds == now.cell.kinds && it->second.cell.rim == now.cell.rim &&
                it->second.cell.coarse == now.cell.coarse &&
                it->second.cell.highEdges == now.cell.highEdges &&
                it->second.cell.openNormal == now.cell.openNormal &&
                it->second.cell.openPosition == now.cell.openPosition;
            written += same ? 0 : 1;
            if (!same) {
                EXPECT_TRUE(std::find(changed.begin(), changed.end(), &now) != changed.end());
            }
            reconsidered = reconsidered || now.reconsidered > 0;
            seenThrough = seenThrough || now.reason == "seen through";
            tornAgain = tornAgain || (it != before.end() && !now.attempts.empty() &&
                                      it->second.state == RiftState::kResolved &&
                                      now.state == RiftState::kBelowResolution);
        }
        EXPECT_EQ(ledger.counts(), counts);
        const bool onlyTries = i == 3 || i == 4;  // the first two of three in vain
        EXPECT_EQ(written == 0, onlyTries);
    }
    EXPECT_TRUE(reconsidered);
    EXPECT_TRUE(seenThrough);
    EXPECT_TRUE(tornAgain);
}

TEST_F(LedgerOnWall, viewsOverTheRimPromiseMoreThanTheOneTaken) {
    FreeSpace space(Eigen::AlignedBox3d(Eigen::Vector3d(-1, -4, -4), Eigen::Vector3d(3, 4, 4)),
                    0.1);
    const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(2.0));
    PlatformLimits limits;
    limits.farLimit = 6;
    const SensorModel sensor = SensorModel::of(view, limits);
    space.carve(view, sensor, space.emptyPixels(view, sensor, false));
    const ViewScorer scorer(sensor, summary, ledger, space, 0.05, ViewScorer::Weights{0.5});
    const ViewScore same = scorer.score(lookAt({0, 0, 0}, {1, 0, 0}));
    const ViewScore beyond = scorer.score(lookAt({0, 1.2, 0}, {1, 1.2, 0}));
    EXPECT_GT(beyond.openGain, 2 * same.openGain);
    EXPECT_FALSE(beyond.cells.empty());
    const ViewScore away = scorer.score(lookAt({0, 0, 0}, {-1, 0, 0}));
    EXPECT_EQ(away.openGain, 0.0);
    const ViewScore tooNear = scorer.score(lookAt({1.9, 0, 0}, {3, 0, 0}));
    EXPECT_EQ(tooNear.openGain, 0.0);
}

/// One torn cell that faces smaller x, and hides `hiddenNormal`.
class BenefitOfATear : public testing::Test {
 protected:
    BenefitOfATear() {
        record.cell.openNormal = {-1, 0, 0};
        record.cell.outward = {0, 0, 1};
        record.cell.kinds = kNoMatch;
        record.cell.rim = 0.08F;
        record.cell.hidden = 0.004F;
    }
    double area(const Eigen::Vector3d& eye) { return benefit(eye).area; }
    ViewScorer::Benefit benefit(const Eigen::Vector3d& eye) {
        Pose pose;
        pose.translation = eye;
        return benefit(pose);
    }
    ViewScorer::Benefit benefit(const Pose& pose) {
        PlatformLimits limits;
        limits.farLimit = 6;
        limits.depthKind = depth;
        limits.nearLimit = 0.5;
        const ViewScorer scorer(SensorModel::of(view, limits), summary, ledger, space, 0.02,
                                weights);
        nearShare = scorer.score(pose).nearShare;
        return scorer.benefit(record, pose);
    }
    ViewScorer::Weights weights;
    double nearShare = 0;  ///< of the last view
    const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(2.0));
    /// The map has the wall at x = 2.
    void seeTheWall() {
        PixelGraph graph{GraphOptions()};
        graph.merge(view);
        summary.update(graph, view);
    }
    RiftRecord record;
    DepthKind depth = DepthKind::kMatched;
    SurfaceSummary summary{0.08, 0.02};

 private:
    RiftLedger ledger{0.02, 4};
    FreeSpace space{Eigen::AlignedBox3d(Eigen::Vector3d(-3, -3, -3), Eigen::Vector3d(3, 3, 3)),
                    0.1};
};

TEST_F(BenefitOfATear, liesWhereTheHiddenSurfaceFaces) {
    record.cell.hiddenNormal = {-1, 0, 0};
    EXPECT_GT(area({-1, 0, 0}), 0.004);
    record.cell.hiddenNormal = {0, 0, 1};  // the top of a wall
    EXPECT_LT(area({-1, 0, 0}), 1e-6);
    EXPECT_GT(area({-1, 0, 1}), 0.004);
    record.cell.hiddenNormal = {0, 0, 0.1F};  // two rims that face each other
    EXPECT_GT(area({-1, 0, 0}), 0.004);
}

TEST_F(BenefitOfATear, isASharePerVainTryAndNothingFromWhereItWasTried) {
    record.cell.hiddenNormal = {-1, 0, 0};
    weights.vain = 0.5;
    weights.vainUnmatched = 0.75;
    const double untried = area({-1, 0, 0});
    ASSERT_GT(untried, 0.004);
    record.attempts.push_back({{0, 0, 1}, 1.0F});
    EXPECT_NEAR(area({-1, 0, 0}), 0.75 * untried, 1e-9);
    record.attempts.push_back({{0, 1, 0}, 1.0F});
    EXPECT_NEAR(area({-1, 0, 0}), 0.75 * 0.75 * untried, 1e-9);
    record.cell.kinds = kImageBorder;
    EXPECT_NEAR(area({-1, 0, 0}), 0.5 * 0.5 * untried, 1e-9);
    record.attempts.push_back({{-1, 0, 0}, 1.0F});
    EXPECT_EQ(area({-1, 0, 0}), 0.0);
}

TEST_F(BenefitOfATear, liesOverTheRimAtASilhouette) {
    record.cell.hidden = 0;
    record.cell.rim = 10;
    const Eigen::Vector3d over(0, 0, 1);
    EXPECT_EQ(area(over), 0.0) << "in the plane of the surface";
    record.cell.kinds = kDepthStep;
    const double first = area(over);
    EXPECT_GT(first, 0.0);
    weights.vain = 1;
    record.attempts.push_back({{-1, 0, 0}, 1.0F});
    const Eigen::Vector3d behind(0.5, 0, 1);
    const double second = area(behind);
    record.attempts.clear();
    EXPECT_GT(second, area(behind)) << "the more so after a vain view from before it";
}

TEST_F(BenefitOfATear, isNothingWhereAFoldIsInTheWay) {
    seeTheWall();
    record.cell.openPosition = record.cell.hiddenPosition = {2.1F, 0, 0};
    record.cell.hiddenNormal = {0, 1, 0};
    const Eigen::Vector3d before(1.6, 1, 0);
    const Eigen::Vector3d behind(2.6, 1, 0);
    EXPECT_EQ(area(before), 0.0);
    EXPECT_GT(area(behind), 0.004);
    // Whether surface that is coarse there is hidden, the depth image tells.
    record.cell.coarse = 0.006F;
    record.cell.openNormal = {0, 1, 0};
    EXPECT_NEAR(area(before), 0.35 * 0.006, 2e-4);
    EXPECT_GT(benefit(before).quality, 0.5) << "a view of it is no try";
    record.cell.openPosition = record.cell.hiddenPosition = {2.4F, 0, 0};  // too far to be a fold
    record.cell.coarse = 0;
    EXPECT_GT(area(before), 0.004);
}

TEST_F(BenefitOfATear, goesByTheWholeLineAroundAnObject) {
    seeTheWall();
    depth = DepthKind::kExact;
    record.cell.openPosition = record.cell.hiddenPosition = {2.4F, 0, 0};
    const Eigen::Vector3d before(1.6, 1, 0);
    for (const Eigen::Vector3f& facing : {Eigen::Vector3f(0, 1, 0), Eigen::Vector3f(-1, 0, 0)}) {
        record.cell.hiddenNormal = facing;
        weights.gapsByLine = false;
        EXPECT_GT(area(before), 0.004) << "the wall is too far to be a fold";
        weights.gapsByLine = true;
        EXPECT_EQ(area(before), 0.0) << "the wall is in the way";
    }
    // How the gap faces is a hint only.
    const Eigen::Vector3d behind(2.6, 1, 0);
    const double obtuse = area(behind);
    record.cell.hiddenNormal = {0, 1, 0};
    const double facing = area(behind);
    record.cell.hiddenNormal = {1, 0, 0};
    const double aside = area(behind);
    record.cell.hiddenNormal = {0, -1, 0};
    EXPECT_LT(area(behind), 0.05 * facing) << "away";
    EXPECT_GT(facing, aside);
    EXPECT_GT(aside, obtuse);
    EXPECT_GT(obtuse, 0.3 * facing) << "turned away by 101 degrees";
    depth = DepthKind::kMatched;
    record.cell.hiddenNormal = {-1, 0, 0};
    EXPECT_EQ(area(behind), 0.0) << "matching needs a view from before it";
}

TEST_F(BenefitOfATear, suffersFromNearSurfaceOnlyWhereDepthIsMatched) {
    seeTheWall();
    const Pose close = lookAt({1.7, 0, 0}, {2, 0, 0});
    benefit(close);
    EXPECT_GT(nearShare, 0.9);
    benefit(lookAt({1, 0, 0}, {2, 0, 0}));
    EXPECT_EQ(nearShare, 0.0) << "far enough";
    for (const DepthKind other : {DepthKind::kPixelwise, DepthKind::kExact}) {
        depth = other;
        benefit(close);
        EXPECT_EQ(nearShare, 0.0);
    }
}

TEST_F(BenefitOfATear, needsBothCamerasButWithExactDepth) {
    seeTheWall();
    record.cell.openPosition = record.cell.hiddenPosition = {2.05F, 0, 0};
    record.cell.hiddenNormal = {0, 1, 0};
    Pose behind;  // the left camera
    behind.translation = {2.07, 0.5, 0};
    ASSERT_GT(view.camera.baseline, 0.1);
    EXPECT_GT(benefit(behind).area, 0.004) << "the right one farther from the wall";
    behind.rotation = Eigen::AngleAxisd(3.14159265, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    EXPECT_EQ(benefit(behind).area, 0.0) << "the right one before it";
    depth = DepthKind::kExact;
    EXPECT_GT(benefit(behind).area, 0.004);
}

TEST_F(BenefitOfATear, leavesCoarseSurfaceItsOwnSide) {
    record.cell.hiddenNormal = {0, 0, 1};
    record.cell.coarse = 0.006F;
    EXPECT_NEAR(area({-1, 0, 0}), 0.35 * 0.006, 2e-4);
}

TEST_F(BenefitOfATear, isNextToNothingWithoutAGap) {
    record.cell.hidden = 0;
    EXPECT_LT(area({-1, 0, 0}), 1e-4);
    EXPECT_GT(area({-1, 0, 0}), 0.0);
}

TEST_F(BenefitOfATear, countsAtFlatAnglesIfDepthIsNotMatched) {
    record.cell.hiddenNormal = {-1, 0, 0};
    const Eigen::Vector3d flat(-0.27, 0.96, 0);
    const double fromMatching = area(flat);
    depth = DepthKind::kPixelwise;
    EXPECT_GT(area(flat), 3 * fromMatching);
}

}  // namespace
}  // namespace riftmap
