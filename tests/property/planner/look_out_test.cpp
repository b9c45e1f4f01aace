// SPDX-License-Identifier: BSD-3-Clause
// Looking out of a tear through the map, against every vertex of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "choice_twin.h"
#include "planner_scene.h"
#include "random_scene.h"

namespace riftmap {

namespace {

class LookOutTwin : public testing::TestWithParam<std::uint32_t> {
 protected:
    LookOutTwin() : scene(GetParam()), graph(options()), knowledge(graph, limits(), planner()) {
        for (const Pose& pose : {lookAt({0, 0, 0}, {1, 0, 0}), lookAt({0, 0.4, 0.2}, {2, 0, 0}),
                                 lookAt({0.3, -0.3, 0}, {2, -0.4, 0.2})}) {
            const View view = scene.see(pose);
            graph.merge(view);
            knowledge.update(view);
        }
        knowledge.updateReach();
        graph.forEachVertex(
            [&](VertexId id) { vertices.push_back(graph.position(id).cast<double>()); });
    }
    static GraphOptions options() {
        GraphOptions o;
        o.targetResolution = 0.02;
        return o;
    }
    static PlatformLimits limits() {
        PlatformLimits limits;
        limits.boxMin = Eigen::Vector3d(-1, -2, -2);
        limits.boxMax = Eigen::Vector3d(3, 2, 2);
        limits.clearance = 0.1;
        limits.nearLimit = 0.4;
        limits.farLimit = 4;
        return limits;
    }
    static PlannerOptions planner() {
        PlannerOptions o;
        o.voxelSize = 0.06;
        o.surfaceBox = {0.9, -2.1, -2.1, 3.1, 2.1, 2.1};  // before it the camera may move about
        return o;
    }

    /// Can the camera be there to look back?
    bool isPlace(const RiftRecord& record, const Eigen::Vector3d& out, double s) const {
        const Eigen::Vector3d at = record.cell.openPosition.cast<double>() + s * out;
        return s > 1.02 * knowledge.sensor().nearLimit && s < knowledge.sensor().farLimit &&
               std::isfinite(knowledge.space().distanceTo(at)) && !RiftLedger::tried(record, at);
    }
    /// Of all vertices within half the resolution of a line out of a tear, where along it [m].
    std::vector<Eigen::Vector3d> beside(const Eigen::Vector3d& p,
                                        const Eigen::Vector3d& out) const {
        std::vector<Eigen::Vector3d> near;
        for (const Eigen::Vector3d& v : vertices) {
            if ((v - p).cross(out).norm() <= kHalf + 1e-5) {
                near.push_back(v);
            }
        }
        return near;
    }
    /// Before this the line has kept from all vertices, in places that are known free or not.
    double clearUntil(const Eigen::Vector3d& p, const Eigen::Vector3d& out) const {
        double least = knowledge.sensor().farLimit;
        for (const Eigen::Vector3d& v : beside(p, out)) {
            const double along = (v - p).dot(out);
            const double off = (v - p - along * out).norm();
            const double end = along + std::sqrt(std::max(0.0, kHalf * kHalf - off * off));
            if (end > 3 * kResolution - 1e-5) {
                least =
                    std::min(least, along - std::sqrt(std::max(0.0, kHalf * kHalf - off * off)));
            }
        }
        return least;
    }
    /// The march of lookOut() with all vertices in place of an index over them.
    std::optional<double> march(const RiftRecord& record, const Eigen::Vector3d& out) const {
        const Eigen::Vector3d p = record.cell.openPosition.cast<double>();
        const std::vector<Eigen::Vector3d> near = beside(p, out);
        const double stride = std::max(kResolution, 0.5 * knowledge.space().voxelSize());
        for (double s = 3 * kResolution; s < knowledge.sensor().farLimit;) {
            const Eigen::Vector3d at = p + s * out;
            const bool free = knowledge.space().at(at) == FreeSpace::State::kFree;
            if (!free && std::any_of(near.begin(), near.end(), [&](const Eigen::Vector3d& v) {
                    return (v - at).norm() <= kHalf;
                })) {
                return std::nullopt;
            }
            if (isPlace(record, out, s)) {
                return s;
            }
            s += free ? stride : kResolution;
        }
        return std::nullopt;
    }
    std::vector<const RiftRecord*> someOpen() {
        std::vector<const RiftRecord*> open;
        for (const auto& [key, record] : knowledge.ledger().records()) {
            if (record.state == RiftState::kOpen) {
                open.push_back(&record);
            }
        }
        std::shuffle(open.begin(), open.end(), scene.random);
        open.resize(std::min<std::size_t>(open.size(), 12));
        return open;
    }

    static constexpr double kResolution = 0.02;
    static constexpr double kHalf = 0.5 * kResolution;

    test::RandomScene scene;
    PixelGraph graph;
    Knowledge knowledge;
    std::vector<Eigen::Vector3d> vertices;
};

TEST_P(LookOutTwin, findsWhatAllVerticesLeaveInSight) {
    SCOPED_TRACE("seed " + std::to_string(GetParam()));
    std::vector<Pose> pool;
    ObjectMemory memory;
    const Choice choice(knowledge, pool, memory);
    const double stride = std::max(kResolution, 0.5 * knowledge.space().voxelSize());
    int found = 0;
    int hidden = 0;
    for (const RiftRecord* record : someOpen()) {
        const Eigen::Vector3d p = record->cell.openPosition.cast<double>();
        for (int i = 0; i < 100; ++i) {
            const Eigen::Vector3d out =
                scene.place(Eigen::Vector3d::Constant(-1), Eigen::Vector3d::Constant(1))
                    .normalized();
            const auto eye = ChoiceTwin::lookOut(choice, *record, out);
            const auto slow = march(*record, out);
            ASSERT_EQ(eye.has_value(), slow.has_value()) << p.transpose();
            if (eye) {
                ++found;
                EXPECT_LT((*eye - p - *slow * out).norm(), 1e-9);
            } else {
                ++hidden;
            }
            // Whatever the steps: a stretch of places behind a line that is clear is not missed.
            const double clear = clearUntil(p, out);
            double since = -1;
            for (double s = 3 * kResolution; s < clear - kHalf; s += 0.1 * kResolution) {
                since = !isPlace(*record, out, s) ? -1 : since < 0 ? s : since;
                if (since >= 0 && s - since > stride) {
                    EXPECT_TRUE(eye) << p.transpose() << " towards " << out.transpose();
                    break;
                }
            }
        }
    }
    EXPECT_GT(found, 20);
    EXPECT_GT(hidden, 20);
}

TEST_P(LookOutTwin, looksToAllSidesBeforeItSaysHidden) {
    SCOPED_TRACE("seed " + std::to_string(GetParam()));
    std::vector<Pose> pool;
    ObjectMemory memory;
    Choice choice(knowledge, pool, memory);
    std::size_t some = 0;
    for (const RiftRecord* record : someOpen()) {
        const Eigen::Vector3d p = record->cell.openPosition.cast<double>();
        const Eigen::Vector3d normal = record->cell.openNormal.cast<double>();
        const bool anySide =
            (record->cell.kinds & kDepthStep) != 0 || record->cell.hidden > 0 || normal.isZero();
        std::vector<Eigen::Vector3d> eyes;
        for (int i = 0; i < 400; ++i) {  // evenly over the sphere, from its top to its bottom
            const double z = 1 - (2 * i + 1.0) / 400;
            const double r = std::sqrt(1 - z * z);
            const Eigen::Vector3d out(r * std::cos(2.399963 * i), r * std::sin(2.399963 * i), z);
            const auto s = march(*record, out);
            if (s && (anySide || out.dot(normal) > 0.2)) {
                const Eigen::Vector3d at = p + *s * out;
                eyes.push_back(knowledge.placeAt(at)->eye);
            }
        }
        const auto candidates = ChoiceTwin::allInSight(choice, *record, 1000);
        ASSERT_EQ(candidates.size(), eyes.size()) << p.transpose();
        for (const Candidate& c : candidates) {
            EXPECT_TRUE(std::any_of(eyes.begin(), eyes.end(), [&](const Eigen::Vector3d& eye) {
                return (eye - c.pose.translation).norm() < 1e-9;
            }));
        }
        EXPECT_EQ(ChoiceTwin::allInSight(choice, *record, 5).size(),
                  std::min<std::size_t>(5, eyes.size()));
        EXPECT_TRUE(eyes.empty() || ChoiceTwin::mayBeSeen(choice, *record));
        some += eyes.empty() ? 0 : 1;
    }
    EXPECT_GT(some, 2U);
}

INSTANTIATE_TEST_SUITE_P(Seeds, LookOutTwin, testing::Range(1U, 6U));

/// A wall two metres ahead, sampled far more sparsely than asked: all of it is open.
class LastResorts : public testing::Test {
 protected:
    /// As it is seen at once, from where the camera is; limits of the range [m].
    std::unique_ptr<Knowledge> knowledgeOf(double nearLimit, double farLimit, double minGain) {
        PlatformLimits limits;
        limits.boxMin = Eigen::Vector3d(-1, -2, -2);
        limits.boxMax = Eigen::Vector3d(3, 2, 2);
        limits.nearLimit = nearLimit;
        limits.farLimit = farLimit;
        PlannerOptions options;
        options.minGain = minGain;
        options.voxelSize = 0.1;
        auto knowledge = std::make_unique<Knowledge>(graph, limits, options);
        const View view = test::viewOf(lookAt({0, 0, 0}, {1, 0, 0}), test::wall(2.0));
        graph.merge(view);
        knowledge->update(view);
        knowledge->updateReach();
        return knowledge;
    }

    PixelGraph graph{test::graphOptions(0.005)};
    std::vector<Pose> pool;
    ObjectMemory memory;
};

TEST_F(LastResorts, leaveTheSmallestOfThousandsToTheOthersReason) {
    const auto known = knowledgeOf(PlatformLimits().nearLimit, 2.6, 1);  // no view is worth it
    Knowledge& knowledge = *known;
    const auto open = knowledge.ledger().counts()[static_cast<std::size_t>(RiftState::kOpen)];
    ASSERT_GT(open, 4000U);
    Choice choice(knowledge, pool, memory);
    EXPECT_FALSE(ChoiceTwin::lastResorts(choice));
    std::size_t notLookedAt = 0;
    float smallest = 1e9F;
    float largest = 0;
    for (const auto& [key, record] : knowledge.ledger().records()) {
        EXPECT_NE(record.state, RiftState::kOpen);
        const float size = knowledge.ledger().tear(record.cell, knowledge.summary().cellSize());
        if (record.reason.rfind("not looked at by itself", 0) == 0) {
            EXPECT_EQ(record.state, RiftState::kDeferred);
            largest = std::max(largest, size);
            ++notLookedAt;
        } else if (record.reason != "shorter than the asked resolution") {
            smallest = std::min(smallest, size);
        }
    }
    EXPECT_EQ(notLookedAt, open - 2000);
    EXPECT_LE(largest, smallest);
}

TEST_F(LastResorts, callHiddenWhatATearMayHideAndNotWhatIsSeenTooCoarsely) {
    // Farther from the wall than all that is known.
    const auto known = knowledgeOf(4.5, 4.6, 0);
    Knowledge& knowledge = *known;
    Choice choice(knowledge, pool, memory);
    std::size_t torn = 0;
    std::size_t coarse = 0;
    for (const auto& [key, record] : knowledge.ledger().records()) {
        const bool hides = record.cell.rim > 0 || record.cell.hidden > 0;
        std::size_t& count = hides ? torn : coarse;
        if (record.state == RiftState::kOpen && count < 20) {
            ChoiceTwin::giveUpHidden(choice, record);
            EXPECT_EQ(record.state, hides ? RiftState::kUnobservable : RiftState::kBelowResolution)
                << record.reason;
            ++count;
        }
    }
    EXPECT_EQ(torn, 20U);
    EXPECT_EQ(coarse, 20U);
}

}  // namespace
}  // namespace riftmap
