// SPDX-License-Identifier: BSD-3-Clause
// What a view is said to see, against every cell projected onto every other.
#include "riftmap/planner/view_scorer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "random_scene.h"

namespace riftmap {
namespace {

/// The scorer's picture of a scene, and the same worked out cell by cell.
struct Watched {
    Watched(std::uint32_t seed, double cell, double resolution_, bool withGaps = false)
        : scene(seed),
          graph(test::graphOptions(resolution_)),
          summary(cell, resolution_),
          ledger(resolution_, 3),
          space(Eigen::AlignedBox3d(Eigen::Vector3d(-1, -4, -4), Eigen::Vector3d(3, 4, 4)), 0.1),
          resolution(resolution_) {
        PlatformLimits limits;
        limits.nearLimit = 0.4;
        limits.farLimit = 6;
        for (const Pose& pose : {lookAt({0, 0, 0}, {1, 0, 0}), lookAt({0, 0.4, 0.2}, {2, 0, 0})}) {
            const View view = scene.see(pose);
            graph.merge(view);
            sensor = SensorModel::of(view, limits);
            const EmptyPixels empty = space.emptyPixels(view, sensor, false);
            seen.add(view, empty);
            summary.update(graph, view, withGaps ? &seen : nullptr);
            ledger.update(summary);
            space.carve(view, sensor, empty);
        }
        if (seed % 2 == 0) {  // no whole number of the scorer's pixels, and a part without partner
            sensor.camera.width = 260;
            sensor.camera.height = 188;
            sensor.firstColumn = 30;
        }
    }
    ViewScorer scorer(const ViewScorer::Weights& weights = {0.5}) const {
        return {sensor, summary, ledger, space, resolution, weights};
    }
    Pose anyPose() {
        return lookAt(scene.place({-0.5, -1.2, -1}, {1.4, 1.2, 1}),
                      scene.place({1.5, -1, -1}, {3, 1, 1}));
    }
    test::RandomScene scene;
    PixelGraph graph;
    SeenThrough seen;
    SurfaceSummary summary;
    RiftLedger ledger;
    FreeSpace space;
    SensorModel sensor;
    double resolution;
};

enum class Sight { kNo, kYes, kRounding };  // the last: single precision may go either way

/// No buffer, no blocks: which cell's square hides the place of another in the image.
class SlowSight {
 public:
    SlowSight(const Watched& watched, const Pose& world_T_camera)
        : sensor_(watched.sensor),
          camera_T_world_(world_T_camera.inverse()),
          cell_(watched.summary.cellSize()) {
        for (const auto& [key, block] : watched.summary.blocks()) {
            for (const SurfaceCell& cell : block.cells) {
                put(inCamera(cell.position), 0.6 * cell_);
            }
        }
    }
    void put(const FreeSpace::Frontier& place, double edge) {
        put(inCamera(place.centre), 0.5 * edge);
    }

    Sight of(const SurfaceCell& cell) const { return at(cell.openPosition, 2 * cell_); }

    /// Unless something stands more than `slack` before it.
    Sight at(const Eigen::Vector3f& place, double slack) const {
        const Eigen::Vector3d p = inCamera(place);
        const double inside = insideBy(p);
        if (inside < -kDoubt || p.z() <= 0) {
            return Sight::kNo;
        }
        const Eigen::Vector2d uv = sensor_.camera.project(p);
        // A pixel begins half before its centre. What is left over belongs to the last.
        const StereoCamera& c = sensor_.camera;
        const double column =
            std::min((uv.x() + 0.5) / kPixels, std::floor(c.width / kPixels) - 0.5);
        const double row = std::min((uv.y() + 0.5) / kPixels, std::floor(c.height / kPixels) - 0.5);
        bool doubt = inside < kDoubt || nearWhole(column) || nearWhole(row);
        for (const auto& square : squares_) {
            const double before = p.z() - slack - square.centre.z();
            const Sight covers = hides(square, std::floor(column), std::floor(row));
            if (before > kDoubt && covers == Sight::kYes && !doubt) {
                return Sight::kNo;
            }
            doubt = doubt || (before > -kDoubt && covers != Sight::kNo &&
                              (before < kDoubt || covers == Sight::kRounding));
        }
        return doubt ? Sight::kRounding : Sight::kYes;
    }

    /// Whether a place is in the image and within the range, whatever stands before it.
    Sight inImage(const Eigen::Vector3f& place) const {
        const double inside = insideBy(inCamera(place));
        return inside < -kDoubt ? Sight::kNo : inside > kDoubt ? Sight::kYes : Sight::kRounding;
    }

 private:
    Eigen::Vector3d inCamera(const Eigen::Vector3f& place) const {
        return camera_T_world_ * Eigen::Vector3d(place.cast<double>());
    }

    /// How far a place is from the borders of what the camera sees, [m] or [px]; negative outside.
    double insideBy(const Eigen::Vector3d& p) const {
        const double least = 1.02 * sensor_.nearLimit;
        const StereoCamera& c = sensor_.camera;
        const Eigen::Vector2d uv = c.project(p);
        return p.z() <= 0 ? p.z() - least
                          : std::min({p.z() - least, sensor_.farLimit - p.z(),
                                      uv.x() - sensor_.firstColumn - kMargin,
                                      c.width - 1 - kMargin - uv.x(), uv.y() - kMargin,
                                      c.height - 1 - kMargin - uv.y()});
    }

    static constexpr double kPixels = 12;   // of the image to one of the scorer's
    static constexpr double kMargin = 6;    // [px] at the border nothing is seen
    static constexpr double kDoubt = 2e-3;  // [px], [m]

    static bool nearWhole(double x) { return std::abs(x - std::round(x)) < kDoubt; }

    struct Square {
        Eigen::Vector3d centre;  ///< in the camera's frame
        double half;             ///< edge [m]
    };
    void put(const Eigen::Vector3d& inCamera, double half) {
        if (inCamera.z() > 0.05 && inCamera.z() < sensor_.farLimit) {
            squares_.push_back({inCamera, half});
        }
    }

    /// Whether a square reaches over the middle of a pixel.
    Sight hides(const Square& square, double column, double row) const {
        const StereoCamera& c = sensor_.camera;
        const Eigen::Vector3d& p = square.centre;
        const double half = c.fx / kPixels * square.half / p.z();
        const double u = c.fx / kPixels * p.x() / p.z() + (c.cx + 0.5) / kPixels - 0.5;
        const double v = c.fy / kPixels * p.y() / p.z() + (c.cy + 0.5) / kPixels - 0.5;
        // Ends count to the pixel that they are in, so half a pixel more.
        const double over = half + 0.5 - std::max(std::abs(u - column), std::abs(v - row));
        return over < -kDoubt ? Sight::kNo : over > kDoubt ? Sight::kYes : Sight::kRounding;
    }

    SensorModel sensor_;
    Pose camera_T_world_;
    double cell_;
    std::vector<Square> squares_;
};

bool isWell(const ViewScorer::Benefit& b) {
    return b.area > 0 && b.quality > 0.5;
}

/// Whether half of what a view promises it sees well; nothing where rounding may decide.
std::optional<bool> livesOnWhatItSeesWell(const ViewScorer& scorer, const SlowSight& slow,
                                          const Pose& pose, double openGain) {
    double sure = 0;
    double possible = 0;
    for (const RiftRecord* record : scorer.open()) {
        const ViewScorer::Benefit b = scorer.benefit(*record, pose);
        const Sight sight = isWell(b) ? slow.of(record->cell) : Sight::kNo;
        sure += sight == Sight::kYes ? b.area : 0.0;
        possible += sight != Sight::kNo ? b.area : 0.0;
    }
    const double half = 0.5 * openGain;
    return sure >= half      ? std::optional(true)
           : possible < half ? std::optional(false)
                             : std::nullopt;
}

class ScorerTwin : public testing::TestWithParam<std::uint32_t> {};

TEST_P(ScorerTwin, seesTheCellsThatNothingHides) {
    SCOPED_TRACE("seed " + std::to_string(GetParam()));
    Watched watched(GetParam(), 0.08, 0.02);
    const ViewScorer scorer = watched.scorer();
    std::size_t seen = 0;
    std::size_t hidden = 0;
    std::size_t doubtful = 0;
    std::array<std::size_t, 2> lives{};
    for (int i = 0; i < 40; ++i) {
        const Pose pose = watched.anyPose();
        const ViewScore score = scorer.score(pose);
        const SlowSight slow(watched, pose);
        const auto livesOnIt = livesOnWhatItSeesWell(scorer, slow, pose, score.openGain);
        lives[livesOnIt.value_or(true) ? 1 : 0] += livesOnIt ? 1 : 0;
        double sure = 0;
        double possible = 0;
        for (const RiftRecord* record : scorer.open()) {
            const ViewScorer::Benefit b = scorer.benefit(*record, pose);
            const Sight sight = slow.of(record->cell);
            seen += sight == Sight::kYes ? 1 : 0;
            hidden += sight == Sight::kNo ? 1 : 0;
            doubtful += sight == Sight::kRounding ? 1 : 0;
            sure += sight == Sight::kYes ? b.area : 0.0;
            possible += sight != Sight::kNo ? b.area : 0.0;
            if (sight == Sight::kRounding) {
                continue;
            }
            const std::uint64_t key = record->cell.key;
            EXPECT_EQ(std::binary_search(score.cells.begin(), score.cells.end(), key),
                      isWell(b) && sight == Sight::kYes)
                << record->cell.openPosition.transpose();
            if (livesOnIt) {
                const auto& rest = score.badlySeen;
                EXPECT_EQ(std::find(rest.begin(), rest.end(), key) != rest.end(),
                          !*livesOnIt && !isWell(b) && b.area > 0 && sight == Sight::kYes)
                    << record->cell.openPosition.transpose();
            }
        }
        EXPECT_GE(score.openGain, sure - 1e-9);
        EXPECT_LE(score.openGain, possible + 1e-9);
        // With so few cells the estimate leaves none out.
        EXPECT_EQ(scorer.estimate(*scorer.draw(pose)).openGain, score.openGain);
        EXPECT_EQ(scorer.estimate(*scorer.draw(pose)).cells, score.cells);
    }
    EXPECT_FALSE(scorer.samples());
    EXPECT_GT(seen, 1600U);
    EXPECT_GT(hidden, 1600U);
    EXPECT_LT(doubtful, (seen + hidden) / 10);
    EXPECT_GT(lives[0], 0U);
    EXPECT_GT(lives[1], 0U);
}

/// Beyond 6000 open cells the estimate takes every n-th: the sum over those, n times, and not
/// farther from the whole than a sample of so many may be.
TEST_P(ScorerTwin, anEstimateIsTheSumOfASample) {
    SCOPED_TRACE("seed " + std::to_string(GetParam()));
    Watched watched(GetParam(), 0.02, 0.005);
    const ViewScorer scorer = watched.scorer();
    ASSERT_TRUE(scorer.samples()) << scorer.open().size();
    const std::size_t stride = (scorer.open().size() + 5999) / 6000;
    ASSERT_GT(stride, 1U);
    for (int i = 0; i < 4; ++i) {
        const Pose pose = watched.anyPose();
        const ViewScore score = scorer.score(pose);
        const ViewScore estimate = scorer.estimate(*scorer.draw(pose));
        const SlowSight slow(watched, pose);
        double sure = 0;
        double possible = 0;
        double squares = 0;
        for (std::size_t k = 0; k < scorer.open().size(); ++k) {
            const double area = scorer.benefit(*scorer.open()[k], pose).area;
            if (area <= 0) {
                continue;
            }
            const Sight sight = slow.of(scorer.open()[k]->cell);
            squares += sight != Sight::kNo ? area * area : 0.0;
            if (k % stride == 0) {
                const auto n = static_cast<double>(stride);
                sure += sight == Sight::kYes ? n * area : 0.0;
                possible += sight != Sight::kNo ? n * area : 0.0;
            }
        }
        EXPECT_GE(estimate.openGain, sure - 1e-9);
        EXPECT_LE(estimate.openGain, possible + 1e-9);
        const double deviation = std::sqrt(static_cast<double>(stride - 1) * squares);
        EXPECT_NEAR(estimate.openGain, score.openGain, 4 * deviation + 1e-9);
    }
}

TEST_P(ScorerTwin, seesIntoTheGapsWhoseLinesAreOpen) {
    SCOPED_TRACE("seed " + std::to_string(GetParam()));
    Watched watched(GetParam(), 0.08, 0.02, true);
    ViewScorer::Weights weights;
    weights.gapsByLine = true;
    const ViewScorer scorer = watched.scorer(weights);
    std::size_t open = 0;
    std::size_t closed = 0;
    for (int i = 0; i < 20; ++i) {
        const Pose pose = watched.anyPose();
        const SlowSight slow(watched, pose);
        const auto shareIn = [](const std::vector<riftmap::Sight>& sights, std::size_t item) {
            const auto it = std::find_if(sights.begin(), sights.end(),
                                         [&](const auto& s) { return s.item == item; });
            return it == sights.end() ? 0.0F : it->share;
        };
        const ViewScorer::Seen seen = scorer.sights(pose);
        const ViewScorer::Seen most = scorer.sightsAtMost(pose);
        EXPECT_TRUE(seen.gaps.empty());
        for (std::size_t k = 0; k < scorer.open().size(); ++k) {
            const SurfaceCell& cell = scorer.open()[k]->cell;
            const Sight sight = slow.inImage(cell.hiddenPosition);
            if (cell.hidden <= 0 || sight == Sight::kRounding) {
                continue;
            }
            const double torn = scorer.benefit(*scorer.open()[k], pose).torn;
            const bool in = sight == Sight::kYes && torn > 0.02;
            EXPECT_FLOAT_EQ(shareIn(seen.sights, 2 * k), in ? static_cast<float>(torn) : 0.0F);
            const float atMost = shareIn(most.sights, 2 * k);
            EXPECT_GE(atMost, shareIn(seen.sights, 2 * k));
            open += in ? 1 : 0;
            closed += !in && atMost > 0 ? 1 : 0;
        }
    }
    EXPECT_GT(open, 20U);
    EXPECT_GT(closed, 20U);
}

TEST_P(ScorerTwin, seesTheFrontierThatNothingHides) {
    SCOPED_TRACE("seed " + std::to_string(GetParam()));
    Watched watched(GetParam(), 0.08, 0.02);
    ViewScorer scorer = watched.scorer();
    constexpr double kEdge = 0.06;
    std::vector<FreeSpace::Frontier> frontier(300);  // more than are drawn at once
    for (FreeSpace::Frontier& place : frontier) {
        place.centre = watched.scene.place({0.5, -1.5, -1.2}, {3, 1.5, 1.2}).cast<float>();
        place.area = watched.scene.place({-1, -1, -1}, {1, 1, 1}).cast<float>();
    }
    scorer.setFrontier(frontier, kEdge);
    std::size_t seen = 0;
    std::size_t hidden = 0;
    for (int i = 0; i < 20; ++i) {
        const Pose pose = watched.anyPose();
        const SlowSight cells(watched, pose);
        SlowSight slow(watched, pose);
        for (const FreeSpace::Frontier& place : frontier) {
            slow.put(place, kEdge);
        }
        const ViewScorer::Seen view = scorer.sightsAtMost(pose);
        for (std::size_t k = 0; k < frontier.size(); ++k) {
            const auto shareOf = [&](std::size_t item) {
                const auto it = std::find_if(view.sights.begin(), view.sights.end(),
                                             [&](const auto& s) { return s.item == item; });
                return it == view.sights.end() ? 0.0 : static_cast<double>(it->share);
            };
            const Sight sight = slow.at(frontier[k].centre, 0.6 * kEdge);
            const Eigen::Vector3d ray = pose.translation - frontier[k].centre.cast<double>();
            const double facing =
                2 * ray.normalized().dot(frontier[k].area.cast<double>().normalized());
            if (sight == Sight::kRounding || std::abs(facing) < 0.1) {
                continue;
            }
            const double depth = (pose.inverse() * frontier[k].centre.cast<double>()).z();
            const double full = 1.5 * watched.sensor.goodDepth(watched.resolution);
            const double good = watched.sensor.goodDepth(watched.resolution);
            const bool in = sight == Sight::kYes && facing > 0;
            const auto expect = [&](std::size_t item, double share) {
                if (std::abs(share - 0.02) > 1e-3) {  // less is not worth a sight
                    EXPECT_NEAR(shareOf(item), in && share > 0.02 ? share : 0.0, 1e-4);
                }
            };
            const std::size_t item = 2 * (scorer.open().size() + k);
            expect(item, std::min(facing, 1.0) * std::min(1.0, std::pow(full / depth, 2)));
            expect(item + 1, std::min(facing, 1.0) * std::min(1.0, std::pow(good / depth, 4)));
            seen += in ? 1 : 0;
            hidden +=
                sight == Sight::kNo && cells.at(frontier[k].centre, 0.6 * kEdge) == Sight::kYes ? 1
                                                                                                : 0;
        }
    }
    EXPECT_GT(seen, 100U);
    EXPECT_GT(hidden, 100U);  // by others of the frontier
}

INSTANTIATE_TEST_SUITE_P(Seeds, ScorerTwin, testing::Range(1U, 6U));

}  // namespace
}  // namespace riftmap
