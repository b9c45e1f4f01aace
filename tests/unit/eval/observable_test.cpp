// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/observable.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "riftmap/eval/coverage.h"
#include "shapes.h"

namespace riftmap {
namespace {

/// A room 4 x 3 x 2.5 m with a closed box on the floor in one corner's distance.
class RoomSpace : public ::testing::Test {
 protected:
    RoomSpace() {
        append(mesh_, shapes::box({2, 1, 0}, {3, 2, 1}));
        space_.boxMax = {4, 3, 2.5};
        space_.start = {1, 1, 1};
        space_.clearance = 0.2;
        space_.nearLimit = 0.4;
        space_.farLimit = 6;
        options_.samples = 6000;
    }
    ObservableSet observe(const OnProgress& progress = {}) const {
        const RayCaster caster(mesh_);
        return observableSet(caster, space_, groundTruthSamples(mesh_, options_), options_,
                             progress);
    }

    TriangleMesh mesh_ = shapes::box({0, 0, 0}, {4, 3, 2.5F}, true);
    ViewSpace space_;
    EvalOptions options_;
};

TEST_F(RoomSpace, EverythingButTheFloorUnderTheBoxIsObservable) {
    const ObservableSet set = observe();
    const SurfaceSamples samples = groundTruthSamples(mesh_, options_);
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        const Eigen::Vector3f& p = samples.points[i];
        const bool under = p.z() < 1e-4F && p.x() > 2 && p.x() < 3 && p.y() > 1 && p.y() < 2;
        ASSERT_EQ(set.observable[i] != 0, !under) << p.transpose();
        ASSERT_GT(set.normals[i].dot(samples.normals[i]), 0) << "seen from the front only";
    }
}

TEST_F(RoomSpace, VerdictsAreTrueWhereNothingIsLeftToSee) {
    // The map has everything observable but a patch of the wall x = 0.
    options_.samples = 100000;
    const RayCaster caster(mesh_);
    const CoverageJudge judge(mesh_, caster, space_, options_);
    std::vector<Eigen::Vector3f> map;
    for (std::size_t i = 0; i < judge.samples().points.size(); ++i) {
        const Eigen::Vector3f& p = judge.samples().points[i];
        const bool patch = p.x() < 1e-4F && p.y() > 1 && p.y() < 2 && p.z() > 0.5F && p.z() < 1.5F;
        if (judge.observable().observable[i] != 0 && !patch) {
            map.push_back(p);
        }
    }
    const std::vector<Eigen::Vector3f> places = {
        {2.5F, 1.5F, 0},   // under the box: uncovered, but no one can see it
        {2, 1.5F, 0},      // its rim
        {0, 1.5F, 1},      // in the patch
        {0, 1.5F, 1.49F},  // at the patch's rim, inside
        {0, 1.5F, 1.7F}};  // on the wall beside
    const auto right = judge.trueVerdicts(judge.sampleDistances(map), 0.02, places);
    EXPECT_EQ(right, (std::vector<std::uint8_t>{1, 1, 0, 0, 1}));
    const CoverageReport report = judge.evaluate(map, {}, nullptr, places);
    EXPECT_EQ(report.verdicts, 5U);
    EXPECT_DOUBLE_EQ(report.certificateRight, 0.6);
    EXPECT_TRUE(std::isnan(judge.evaluate(map, {}).certificateRight)) << "nothing was claimed";
}

TEST_F(RoomSpace, TheSideSeenDecidesTheNormal) {
    for (auto& t : mesh_.triangles) {
        std::swap(t[1], t[2]);  // a mesh with all its fronts turned away
    }
    const ObservableSet set = observe();
    const SurfaceSamples samples = groundTruthSamples(mesh_, options_);
    EXPECT_GT(set.count, 5700U);
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        if (set.observable[i] != 0) {
            ASSERT_LT(set.normals[i].dot(samples.normals[i]), 0);
        }
    }
}

TEST_F(RoomSpace, AWallWithoutADoorHidesWhatIsBehind) {
    append(mesh_, shapes::box({1.7F, -1, -1}, {1.8F, 4, 4}));
    const ObservableSet set = observe();
    const SurfaceSamples samples = groundTruthSamples(mesh_, options_);
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        if (samples.points[i].x() > 1.75F) {
            ASSERT_EQ(set.observable[i], 0) << samples.points[i].transpose();
        }
    }
    EXPECT_GT(set.count, 1500U);
}

TEST_F(RoomSpace, ADoorWiderThanTwiceTheClearanceLetsTheCameraThrough) {
    const auto reachesBehind = [&](double clearance) {
        TriangleMesh world = mesh_;
        append(world, shapes::box({1.7F, -1, -1}, {1.8F, 1.0F, 4}));  // door: 1.0 < y < 1.7
        append(world, shapes::box({1.7F, 1.7F, -1}, {1.8F, 4, 4}));
        const RayCaster caster(world);
        ViewSpace space = space_;
        space.clearance = clearance;
        return ReachableSpace(caster, space, 0.05).contains({3.4, 0.6, 1.5});
    };
    EXPECT_TRUE(reachesBehind(0.30));
    EXPECT_FALSE(reachesBehind(0.36));
}

TEST_F(RoomSpace, IncidenceRangeAndElevationLimitWhatIsSeen) {
    const std::size_t all = observe().count;
    space_.maxElevation = 0.0;  // never upwards: no ceiling
    const ObservableSet down = observe();
    const SurfaceSamples samples = groundTruthSamples(mesh_, options_);
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        if (samples.points[i].z() > 2.4999F) {
            ASSERT_EQ(down.observable[i], 0);
        }
    }
    EXPECT_LT(down.count, all);
    space_.maxElevation = 1.6;
    space_.boxMin = {0.9, 0.9, 0.9};  // nearly one place
    space_.boxMax = {1.1, 1.1, 1.1};
    space_.farLimit = 1.5;
    const ObservableSet near = observe();
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        if (near.observable[i] != 0) {
            ASSERT_LT((samples.points[i] - Eigen::Vector3f(1, 1, 1)).norm(), 1.5F + 0.18F);
        }
    }
    EXPECT_GT(near.count, 30U);
}

TEST_F(RoomSpace, ABadStartIsNamed) {
    const RayCaster caster(mesh_);
    space_.start = {0.1, 1, 1};
    try {
        const ReachableSpace space(caster, space_, 0.1);
        FAIL();
    } catch (const std::runtime_error& e) {
        EXPECT_NE(std::string(e.what()).find("nearer than the clearance"), std::string::npos);
    }
    space_.start = {5, 1, 1};
    EXPECT_THROW(ReachableSpace(caster, space_, 0.1), std::runtime_error);
}

TEST_F(RoomSpace, SameSetForOneAndTwoThreads) {
    const auto with = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return observe();
    };
    const ObservableSet one = with(1);
    const ObservableSet two = with(2);
    EXPECT_EQ(one.observable, two.observable);
    EXPECT_EQ(one.key, two.key);
}

TEST_F(RoomSpace, TheCacheReturnsTheSameSetAndSurvivesDamage) {
    options_.cache = (std::filesystem::temp_directory_path() / "riftmap-observable-test").string();
    std::filesystem::remove_all(options_.cache);
    std::vector<std::size_t> done;
    const OnProgress progress = [&](std::size_t soFar, std::size_t all) {
        EXPECT_EQ(all, 3 * 6000U) << "rounds of looks";
        done.push_back(soFar);
    };
    const ObservableSet first = observe(progress);
    ASSERT_GE(done.size(), 3U);
    EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
    EXPECT_EQ(done.back(), 3 * 6000U);
    done.clear();
    const ObservableSet second = observe(progress);
    EXPECT_TRUE(done.empty()) << "what was found before takes no time";
    EXPECT_FALSE(first.fromCache);
    EXPECT_TRUE(second.fromCache);
    EXPECT_EQ(first.observable, second.observable);
    space_.start = {1.2, 2, 1.5};
    EXPECT_TRUE(observe().fromCache) << "the start does not matter within a connected space";
    space_.clearance = 0.21;
    EXPECT_FALSE(observe().fromCache) << "another view space is another set";
    space_.clearance = 0.2;
    for (const auto& file : std::filesystem::directory_iterator(options_.cache)) {
        std::fstream(file.path(), std::ios::in | std::ios::out | std::ios::binary)
            .seekp(100)
            .put('\x7f');
    }
    const ObservableSet third = observe();
    EXPECT_FALSE(third.fromCache);
    EXPECT_EQ(first.observable, third.observable);
    std::filesystem::remove_all(options_.cache);
}

}  // namespace
}  // namespace riftmap
