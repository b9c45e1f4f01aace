// SPDX-License-Identifier: BSD-3-Clause
// Climbing from the best of a few views to better ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "choice_twin.h"
#include "planner_scene.h"

namespace riftmap {
namespace {

const Eigen::Vector3d kHalf(2.5, 2.0, 1.4);

/// The inside of a room with a pillar.
std::optional<double> insideRoom(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    double nearest = test::insideBox(kHalf, origin, ray);
    const Eigen::Vector2d to = origin.head<2>() - Eigen::Vector2d(1.2, 0.5);
    const double a = ray.head<2>().squaredNorm();
    const double b = to.dot(ray.head<2>());
    const double root = b * b - a * (to.squaredNorm() - 0.09);
    if (a > 0 && root > 0 && -b - std::sqrt(root) > 0) {
        nearest = std::min(nearest, (-b - std::sqrt(root)) / a);
    }
    return nearest;
}

/// Half of the room is seen, so that the camera may move about and there is much left to see.
struct HalfSeenRoom {
    explicit HalfSeenRoom(std::uint32_t seed, double heights = 2 * kHalf.z())
        : graph(test::graphOptions(0.05)), knowledge(graph, limits(heights), plannerOptions(seed)) {
        for (int i = 0; i < 5; ++i) {
            const double a = 0.6 * i;
            const Eigen::Vector3d eye(-1.0 + 0.1 * i, -0.5, 0);
            const View view = test::viewOf(
                lookAt(eye, eye + Eigen::Vector3d(std::cos(a), std::sin(a), 0.1 * i - 0.2)),
                insideRoom);
            graph.merge(view);
            knowledge.update(view);
        }
        knowledge.updateReach();
    }
    static PlatformLimits limits(double heights) {
        PlatformLimits limits;
        limits.boxMin = -kHalf;
        limits.boxMax = kHalf;
        limits.boxMin.z() = -0.5 * heights;
        limits.boxMax.z() = 0.5 * heights;
        limits.clearance = 0.2;
        limits.farLimit = 6;
        limits.minTilt = -0.7;
        limits.maxTilt = 0.5;
        return limits;
    }
    static PlannerOptions plannerOptions(std::uint32_t seed) {
        PlannerOptions o;
        o.voxelSize = 0.08;
        o.places = 8;
        o.seed = seed;
        return o;
    }
    /// Utility of the best of the views so far.
    static double best(Choice& choice) {
        double best = 0;
        for (const Candidate& c : ChoiceTwin::candidates(choice)) {
            best = std::max(best, c.utility);
        }
        return best;
    }

    PixelGraph graph;
    Knowledge knowledge;
    std::vector<Pose> pool;
    ObjectMemory memory;
};

/// A plan's first candidates, scored.
void addFirst(Choice& choice) {
    ChoiceTwin::addTurns(choice);
    for (int i = 0; i < 8; ++i) {
        ChoiceTwin::addPlaces(choice);
    }
    ChoiceTwin::score(choice);
}

TEST(Climb, findsMoreThanAsManyViewsByLot) {
    constexpr std::uint32_t kSeeds = 8;
    double logRatios = 0;
    for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        HalfSeenRoom room(seed);
        ASSERT_GT(room.knowledge.reached(), 1000U);
        Choice choice(room.knowledge, room.pool, room.memory);
        addFirst(choice);
        const double before = HalfSeenRoom::best(choice);
        ASSERT_GT(before, 0);
        const std::vector<Candidate>& all = ChoiceTwin::candidates(choice);
        const std::size_t first = all.size();
        ChoiceTwin::climb(choice);
        const double after = HalfSeenRoom::best(choice);
        EXPECT_GT(after, before);
        for (std::size_t i = first; i < all.size(); ++i) {
            const auto place = room.knowledge.placeAt(all[i].pose.translation);
            ASSERT_TRUE(place);
            EXPECT_EQ(place->eye, all[i].pose.translation);
            EXPECT_EQ(place->path, all[i].path);
            EXPECT_TRUE(room.knowledge.tiltAllowed(all[i].pose));
        }

        Choice byLot(room.knowledge, room.pool, room.memory);
        addFirst(byLot);
        ASSERT_EQ(HalfSeenRoom::best(byLot), before) << "the same to begin with";
        for (int i = 0; i < 1000 && ChoiceTwin::candidates(byLot).size() < all.size(); ++i) {
            ChoiceTwin::addPlaces(byLot);
        }
        ASSERT_GE(ChoiceTwin::candidates(byLot).size(), all.size());
        ChoiceTwin::score(byLot);
        logRatios += std::log(after / HalfSeenRoom::best(byLot));
    }
    const double ratio = std::exp(logRatios / kSeeds);
    RecordProperty("ratio", std::to_string(ratio));
    EXPECT_GT(ratio, 1.15) << "utility of the best view, geometric mean over the seeds";
}

/// The same from the definition: 6 voxels of 8 cm, a cosine of 0.8.
bool areAlike(const Pose& a, const Pose& b) {
    return (a.translation - b.translation).norm() < 6 * 0.08 &&
           a.rotation.col(2).dot(b.rotation.col(2)) > 0.8;
}

/// One after the other: the first of the greatest that is like none before.
template <class F>
std::vector<std::size_t> apart(const std::vector<Candidate>& all, std::size_t most,
                               const F& value) {
    std::vector<std::size_t> apart;
    std::vector<bool> out(all.size(), false);
    while (apart.size() < most) {
        std::size_t next = all.size();
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (!out[i] && value(all[i]) > 0 &&
                (next == all.size() || value(all[i]) > value(all[next]))) {
                next = i;
            }
        }
        if (next == all.size()) {
            break;
        }
        apart.push_back(next);
        for (std::size_t i = 0; i < all.size(); ++i) {
            out[i] = out[i] || areAlike(all[i].pose, all[next].pose);
        }
    }
    return apart;
}

/// On wheels the camera's box is a few voxels high; changes that lead out of it are not lost.
TEST(Climb, movesAboutInAFlatBox) {
    const auto movesAt = [](double heights) {
        std::size_t count = 0;
        for (std::uint32_t seed = 1; seed <= 4; ++seed) {
            HalfSeenRoom room(seed, heights);
            Choice choice(room.knowledge, room.pool, room.memory);
            addFirst(choice);
            const std::vector<Candidate>& all = ChoiceTwin::candidates(choice);
            const std::size_t first = all.size();
            ChoiceTwin::climb(choice);
            count += static_cast<std::size_t>(
                std::count_if(all.begin() + static_cast<std::ptrdiff_t>(first), all.end(),
                              [](const Candidate& c) { return c.path > 0; }));
        }
        return count;
    };
    const std::size_t anywhere = movesAt(2 * kHalf.z());
    ASSERT_GT(anywhere, 300U);
    EXPECT_GT(static_cast<double>(movesAt(0.24)), 0.9 * static_cast<double>(anywhere));
}

TEST(Climb, startsFromWhatThereIs) {
    HalfSeenRoom room(1);
    Choice choice(room.knowledge, room.pool, room.memory);
    std::vector<Candidate>& all = ChoiceTwin::candidates(choice);
    ChoiceTwin::climb(choice);
    EXPECT_TRUE(all.empty());
    ChoiceTwin::addTurns(choice);
    const std::size_t turns = all.size();
    ASSERT_GT(turns, 2U);
    ChoiceTwin::climb(choice);
    EXPECT_EQ(all.size(), turns) << "none is worth anything, as long as they are not scored";
    ChoiceTwin::score(choice);
    const double before = HalfSeenRoom::best(choice);
    all = {*std::find_if(all.begin(), all.end(),
                         [&](const Candidate& c) { return c.utility == before; })};
    ChoiceTwin::climb(choice);
    EXPECT_GT(all.size(), 50U);
    EXPECT_LE(all.size(), 1U + 8 * 2 * 10);
    EXPECT_GT(HalfSeenRoom::best(choice), before);
}

TEST(BestApart, areTheBestThatDiffer) {
    HalfSeenRoom room(1);
    for (std::uint32_t seed = 1; seed <= 8; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> in(-1, 1);
        Choice choice(room.knowledge, room.pool, room.memory);
        std::vector<Candidate>& all = ChoiceTwin::candidates(choice);
        for (int i = 0; i < 800; ++i) {
            Candidate c;
            const double x = in(random), y = in(random), z = in(random);
            const Eigen::Vector3d eye = 0.5 * kHalf.cwiseProduct(Eigen::Vector3d(x, y, z));
            const double aside = 0.8 * in(random), up = 0.8 * in(random);
            c.pose = lookAt(eye, eye + Eigen::Vector3d(1, aside, up));
            c.utility = std::round(10 * in(random));  // some of the same, half of none
            c.score.gain = std::round(100 * in(random));
            c.path = i % 5 == 0 ? 0 : 1;
            all.push_back(c);
        }
        const auto utility = [](const Candidate& c) { return c.utility; };
        const auto worthAnything = static_cast<std::size_t>(std::count_if(
            all.begin(), all.end(), [](const Candidate& c) { return c.utility > 0; }));
        for (const std::size_t most : {std::size_t{2}, std::size_t{20}, all.size()}) {
            const std::vector<std::size_t> expected = apart(all, most, utility);
            EXPECT_EQ(ChoiceTwin::bestApart(choice, most), expected);
            if (most < all.size()) {
                EXPECT_EQ(expected.size(), most);
            } else {
                EXPECT_LT(2 * expected.size(), worthAnything) << "many are alike";
            }
        }
        ChoiceTwin::keepPool(choice);
        const std::vector<std::size_t> kept =
            apart(all, 64, [](const Candidate& c) { return c.path > 0 ? c.score.gain : 0.0; });
        EXPECT_EQ(kept.size(), 64U);
        ASSERT_EQ(room.pool.size(), kept.size());
        for (std::size_t i = 0; i < kept.size(); ++i) {
            EXPECT_EQ(room.pool[i].translation, all[kept[i]].pose.translation);
            EXPECT_EQ(room.pool[i].rotation, all[kept[i]].pose.rotation);
        }
    }
}

}  // namespace
}  // namespace riftmap
