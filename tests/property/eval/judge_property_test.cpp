// SPDX-License-Identifier: BSD-3-Clause
// The quick judge against slow, obvious twins, on random input whose seed a failure prints.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "riftmap/eval/coverage.h"
#include "riftmap/eval/coverage_tracker.h"
#include "riftmap/eval/point_index.h"
#include "shapes.h"

namespace riftmap {
namespace {

using Random = std::mt19937_64;
using Points = std::vector<Eigen::Vector3f>;

float uniform(Random& random, float low, float high) {
    return low + (high - low) * static_cast<float>(random() >> 40) * 0x1p-24F;
}
Eigen::Vector3f pointIn(Random& random, float low, float high) {
    const float x = uniform(random, low, high);
    const float y = uniform(random, low, high);
    return {x, y, uniform(random, low, high)};
}

TEST(PointIndexProperty, AgreesWithLookingAtEveryPoint) {
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        Points points(1 + random() % 400);
        for (auto& p : points) {
            p = pointIn(random, -1, 1);
            if (random() % 50 == 0) {
                p.x() = std::nanf("");
            }
        }
        if (seed % 3 == 0) {
            points.push_back(points[0]);  // the same twice: the first counts
        }
        const PointIndex index(points, uniform(random, 0.02F, 0.8F));
        for (int q = 0; q < 50; ++q) {
            const Eigen::Vector3f query = pointIn(random, -1.3F, 1.3F);
            const float radius = uniform(random, 0.01F, 1.5F);
            std::optional<std::size_t> best;
            std::size_t within = 0;
            for (std::size_t i = 0; i < points.size(); ++i) {
                const float d2 = (points[i] - query).squaredNorm();
                if (!(d2 <= radius * radius)) {
                    continue;
                }
                ++within;
                if (!best || d2 < (points[*best] - query).squaredNorm()) {
                    best = i;
                }
            }
            const auto found = index.nearest(query, radius);
            ASSERT_EQ(found.has_value(), best.has_value());
            if (best) {
                ASSERT_EQ(found->index, *best);
            }
            std::size_t counted = 0;
            index.anyWithin(query, radius, [&](std::uint32_t, float) {
                ++counted;
                return false;
            });
            ASSERT_EQ(counted, within);
        }
    }
}

/// A room with boxes at random places and a start in the clear.
struct RandomRoom {
    explicit RandomRoom(std::uint64_t seed) : mesh(shapes::box({0, 0, 0}, {4, 3, 2.5F}, true)) {
        Random random(seed);
        for (int i = 0; i < 6; ++i) {
            const Eigen::Vector3f low(uniform(random, 1, 3.4F), uniform(random, 0, 2.6F),
                                      uniform(random, 0, 2));
            const Eigen::Vector3f size(uniform(random, 0.05F, 0.8F), uniform(random, 0.05F, 0.8F),
                                       uniform(random, 0.05F, 0.6F));
            append(mesh, shapes::box(low, low + size));
        }
        space.boxMax = {4, 3, 2.5};
        space.start = {0.5, 1.5, 1.2};
        space.clearance = 0.2;
        space.nearLimit = 0.4;
        space.farLimit = 3;
        options.samples = 1000;
        options.deltas = {0.05};
    }
    TriangleMesh mesh;
    ViewSpace space;
    EvalOptions options;
};

/// Looks at every sample from every position of the grid.
std::vector<std::uint8_t> seenFromTheGrid(const RandomRoom& room, const RayCaster& caster,
                                          const SurfaceSamples& samples) {
    std::vector<std::uint8_t> seen(samples.points.size());
    ReachableSpace(caster, room.space, 0.14).forEach([&](const Eigen::Vector3d& eye) {
        for (std::size_t i = 0; i < seen.size(); ++i) {
            const Eigen::Vector3d p = samples.points[i].cast<double>();
            const double range = (eye - p).norm();
            const double cosine =
                std::abs((eye - p).dot(samples.normals[i].cast<double>())) / range;
            seen[i] |= static_cast<std::uint8_t>(
                range >= room.space.nearLimit && range <= room.space.farLimit &&
                cosine >= std::cos(room.options.maxIncidence) && !caster.occluded(p, eye));
        }
    });
    return seen;
}

TEST(ObservableProperty, WhatSomePositionOfTheGridSeesIsObservable) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const RandomRoom room(seed);
        const RayCaster caster(room.mesh);
        const SurfaceSamples samples = groundTruthSamples(room.mesh, room.options);
        const ObservableSet set = observableSet(caster, room.space, samples, room.options);
        const auto seen = seenFromTheGrid(room, caster, samples);
        std::size_t missed = 0;
        std::size_t more = 0;
        for (std::size_t i = 0; i < seen.size(); ++i) {
            missed += seen[i] != 0 && set.observable[i] == 0;
            more += seen[i] == 0 && set.observable[i] != 0;
        }
        // A view narrower than the fan of directions may be missed; positions between those of the
        // grid see a little more.
        EXPECT_LE(missed, 2U);
        EXPECT_LE(more, seen.size() / 25);
    }
}

TEST(CoverageProperty, AgreesWithLookingAtEveryVertex) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const RandomRoom room(seed);
        const RayCaster caster(room.mesh);
        const CoverageJudge judge(room.mesh, caster, room.space, room.options);
        Random random(seed);
        Points map;
        for (int i = 0; i < 3000; ++i) {
            map.push_back(judge.samples().points[random() % judge.samples().points.size()] +
                          pointIn(random, -0.06F, 0.06F));
        }
        map.emplace_back(1e6F, 0.0F, 0.0F);
        std::size_t all = 0;
        std::size_t observable = 0;
        for (std::size_t i = 0; i < judge.samples().points.size(); ++i) {
            const bool covered = std::any_of(map.begin(), map.end(), [&](const auto& v) {
                return (v - judge.samples().points[i]).norm() <= 0.05F;
            });
            all += covered;
            observable += covered && judge.observable().observable[i] != 0;
        }
        const Coverage c = judge.coverage(map)[0];
        const auto total = static_cast<double>(judge.samples().points.size());
        EXPECT_NEAR(c.cAll * total, static_cast<double>(all), 0.5);
        EXPECT_NEAR(c.cObs * static_cast<double>(judge.observable().count),
                    static_cast<double>(observable), 0.5);
    }
}

TEST(CoverageProperty, TheTrackerAgreesWithTheJudgeAfterEveryChange) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        RandomRoom room(seed);
        room.options.deltas = {0.02, 0.05, 0.1};
        const RayCaster caster(room.mesh);
        const CoverageJudge judge(room.mesh, caster, room.space, room.options);
        CoverageTracker tracker(judge);
        Random random(seed);
        const auto& samples = judge.samples().points;
        const Eigen::Vector3f nowhere = Eigen::Vector3f::Constant(std::nanf(""));
        Points map;
        for (int step = 0; step < 30; ++step) {
            // Near one place vertices come, go and move, as a view makes them; some are far off.
            const Eigen::Vector3f& place = samples[random() % samples.size()];
            for (auto& v : map) {
                if ((v - place).norm() < 0.7F && random() % 2 == 0) {
                    v = random() % 4 == 0 ? nowhere : (v + pointIn(random, -0.02F, 0.02F)).eval();
                }
            }
            for (int i = 0; i < 400; ++i) {
                const Eigen::Vector3f& p = samples[random() % samples.size()];
                if ((p - place).norm() < 0.8F) {
                    map.push_back(p + pointIn(random, -0.06F, 0.06F));
                }
            }
            map.emplace_back(1e6F * static_cast<float>(step), 0.0F, 0.0F);
            map.push_back(place + pointIn(random, -3, 3));
            if (step == 20) {
                map.resize(map.size() / 2);
            }
            const auto quick = tracker.update(map);
            const auto slow = judge.coverage(map);
            ASSERT_EQ(quick.size(), slow.size());
            for (std::size_t k = 0; k < quick.size(); ++k) {
                ASSERT_EQ(quick[k].cAll, slow[k].cAll) << "step " << step << " delta " << k;
                ASSERT_EQ(quick[k].cObs, slow[k].cObs) << "step " << step << " delta " << k;
            }
        }
        EXPECT_GT(judge.coverage(map)[1].cAll, 0.02);
    }
}

}  // namespace
}  // namespace riftmap
