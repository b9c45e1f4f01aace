// SPDX-License-Identifier: BSD-3-Clause
// The judge is right: maps whose coverage and errors are known beforehand.
#include "riftmap/eval/coverage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "shapes.h"

namespace riftmap {
namespace {

using Points = std::vector<Eigen::Vector3f>;

/// A sphere of radius 0.5 m that a camera flies round.
class SphereJudge : public ::testing::Test {
 protected:
    static ViewSpace space() {
        ViewSpace s;
        s.boxMin = Eigen::Vector3d::Constant(-2);
        s.boxMax = Eigen::Vector3d::Constant(2);
        s.start = {1.5, 0, 0};
        s.nearLimit = 0.4;
        s.farLimit = 3;
        return s;
    }
    /// Points 1.8 mm apart all over the sphere (Fibonacci's spiral): no place is 2 mm from one.
    static SurfaceSamples spiral(int count) {
        SurfaceSamples map;
        for (int i = 0; i < count; ++i) {
            const double z = 1 - (2 * i + 1) / static_cast<double>(count);
            const double r = std::sqrt(1 - z * z);
            const double a = 2.399963229728653 * i;
            map.normals.push_back(
                Eigen::Vector3d(r * std::cos(a), r * std::sin(a), z).cast<float>());
            map.points.push_back(0.5F * map.normals.back());
        }
        return map;
    }

    TriangleMesh mesh_ = shapes::sphere(0.5, 200);
    RayCaster caster_{mesh_};
    CoverageJudge judge_{mesh_, caster_, space(), EvalOptions{}};
    SurfaceSamples map_ = spiral(1000000);
};

TEST_F(SphereJudge, FollowsTheProtocolForObjects) {
    EXPECT_EQ(judge_.samples().points.size(), 10000U);
    EXPECT_EQ(judge_.deltas(), (std::vector<double>{0.002, 0.005, 0.01}));
    EXPECT_EQ(judge_.headline(), 0.005);
    EXPECT_EQ(judge_.observable().count, 10000U);
}

TEST_F(SphereJudge, AMapSampledFromTheMeshIsComplete) {
    const CoverageReport report = judge_.evaluate(map_.points, map_.normals);
    for (const DistanceFigures& f : report.at) {
        EXPECT_EQ(f.cObs, 1.0) << f.delta;
        EXPECT_EQ(f.cAll, 1.0) << f.delta;
        EXPECT_EQ(f.cObsStrict, 1.0) << f.delta;
        EXPECT_EQ(f.accuracy, 1.0) << f.delta;
        EXPECT_EQ(f.fScore, 1.0) << f.delta;
        EXPECT_EQ(f.spurious, 0.0) << f.delta;
    }
    EXPECT_LT(report.errorP95, 1e-4) << "the facets lie up to 0.015 mm inside";
}

TEST_F(SphereJudge, HalfAMapIsHalfCovered) {
    const double delta = 0.002;
    Points half;
    for (const auto& p : map_.points) {
        if (p.x() < 0) {
            half.push_back(p);
        }
    }
    const CoverageReport report = judge_.evaluate(half, {});
    EXPECT_NEAR(report.atDelta(delta).cObs, 0.5, 0.005);
    EXPECT_EQ(report.atDelta(delta).accuracy, 1.0);
    EXPECT_TRUE(std::isnan(report.atDelta(delta).cObsStrict));  // no normals given
}

TEST_F(SphereJudge, PointsOffByThreeCentimetresAreFoundAtTheirDistance) {
    Points off;
    for (std::size_t i = 0; i < map_.points.size(); i += 25) {
        off.push_back(map_.points[i] + 0.0299F * map_.normals[i]);
    }
    const CoverageReport report = judge_.evaluate(off, {});
    EXPECT_NEAR(report.errorMedian, 0.0299, 1e-4);
    EXPECT_NEAR(report.errorP95, 0.0299, 1e-4);
    EXPECT_EQ(report.atDelta(0.01).cObs, 0.0);
    EXPECT_EQ(report.atDelta(0.01).accuracy, 0.0);
    EXPECT_EQ(report.atDelta(0.005).spurious, 1.0);
    EXPECT_EQ(report.atDelta(0.01).spurious, 0.0) << "3 cm is not farther than three deltas";
}

TEST_F(SphereJudge, AFalseSheetIsCaughtByAccuracy) {
    Points points = map_.points;
    points.resize(200000);
    const Points shell = points;
    const std::size_t sheet = points.size() / 4;
    for (std::size_t i = 0; i < sheet; ++i) {
        const auto x = static_cast<float>(i % 500) / 500 - 0.5F;
        const auto y = static_cast<float>(i / 500) / 500 - 0.5F;
        points.emplace_back(x, y, 1.0F);
    }
    const CoverageReport report = judge_.evaluate(points, {});
    EXPECT_EQ(report.atDelta(0.005).cObs, judge_.coverage(shell)[1].cObs) << "not by coverage";
    EXPECT_NEAR(report.atDelta(0.005).accuracy, 0.8, 1e-9);
    EXPECT_NEAR(report.atDelta(0.005).spurious, 0.2, 1e-9);
}

TEST_F(SphereJudge, TheWrongSideCoversOnlyPlainly) {
    std::vector<Eigen::Vector3f> inwards = map_.normals;
    for (auto& n : inwards) {
        n = -n;
    }
    const CoverageReport report = judge_.evaluate(map_.points, inwards);
    EXPECT_EQ(report.atDelta(0.005).cObs, 1.0);
    EXPECT_EQ(report.atDelta(0.005).cObsStrict, 0.0);
}

TEST_F(SphereJudge, AnEmptyMapCoversNothing) {
    const CoverageReport report = judge_.evaluate({}, {});
    EXPECT_EQ(report.atDelta(0.005).cObs, 0.0);
    EXPECT_TRUE(std::isnan(report.atDelta(0.005).accuracy));
    EXPECT_EQ(report.vertices, 0U);
}

TEST_F(SphereJudge, VerticesThatAreNotFiniteAreLeftOut) {
    Points points = map_.points;
    points.emplace_back(std::nanf(""), 0.0F, 0.0F);
    points.emplace_back(1e30F, 0.0F, 0.0F);
    const CoverageReport report = judge_.evaluate(points, {});
    EXPECT_EQ(report.atDelta(0.005).cObs, 1.0);
    EXPECT_GT(report.atDelta(0.005).accuracy, 0.999);
}

TEST_F(SphereJudge, ARiftExplainsTheHoleItLiesOn) {
    Points open;  // two caps are missing
    for (const auto& p : map_.points) {
        if (std::abs(p.x()) < 0.4F) {
            open.push_back(p);
        }
    }
    const auto distances = judge_.sampleDistances(open);
    const float rim = std::sqrt(0.25F - 0.16F);
    EXPECT_EQ(judge_.explainedShare(distances, 0.005, {}), 0.0);
    EXPECT_NEAR(judge_.explainedShare(distances, 0.005, {{0.4F, rim, 0}}), 0.5, 0.03);
    EXPECT_EQ(judge_.explainedShare(distances, 0.005, {{0.4F, rim, 0}, {-0.4F, rim, 0}}), 1.0);
    EXPECT_EQ(judge_.explainedShare(distances, 0.005, {{0, 0.5F, 0}}), 0.0) << "not on a rim";
    EXPECT_EQ(judge_.explainedShare(judge_.sampleDistances(map_.points), 0.005, {}), 1.0);
    EXPECT_EQ(judge_.evaluate(open, {}, &open).explained, 1.0);
}

TEST_F(SphereJudge, WhatNoRimCanExplainIsNotTold) {
    EvalOptions options;
    options.deltas = {0.03, 0.05, 0.06};
    Points half;
    for (const auto& p : map_.points) {
        if (p.x() < 0) {
            half.push_back(p);
        }
    }
    for (const double headline : options.deltas) {
        options.headline = headline;
        const CoverageJudge judge(mesh_, caster_, space(), options);
        const double explained = judge.evaluate(half, {}, &half).explained;
        if (headline < 0.05) {
            EXPECT_EQ(explained, 1.0);
        } else {  // 5 cm are asked for, and no vertex is so near what is uncovered
            EXPECT_TRUE(std::isnan(explained));
        }
    }
}

TEST(SurfaceSamples, AreEvenByAreaAndTheSameEveryTime) {
    const TriangleMesh torus = shapes::torus(0.4, 0.2);
    EvalOptions options;
    const SurfaceSamples a = groundTruthSamples(torus, options);
    const SurfaceSamples b = groundTruthSamples(torus, options);
    ASSERT_EQ(a.points.size(), 10000U);
    EXPECT_TRUE(std::equal(a.points.begin(), a.points.end(), b.points.begin()));
    // Outside of the ring's circle: by area 1/2 + tube / (pi ring) = 0.659 (Pappus).
    std::size_t outside = 0;
    for (const auto& p : a.points) {
        outside += std::hypot(p.x(), p.y()) > 0.4F;
    }
    EXPECT_NEAR(static_cast<double>(outside) / 1e4, 0.5 + 0.2 / (shapes::kPi * 0.4), 0.005);
    options.sampleSeed = 2;
    EXPECT_NE(groundTruthSamples(torus, options).points[0], a.points[0]);
}

TEST(SurfaceSamples, AreasOfSphereBoxAndTorus) {
    const double pi = shapes::kPi;
    EXPECT_NEAR(area(shapes::sphere(0.5)) / (4 * pi * 0.25), 1, 0.005);
    EXPECT_NEAR(area(shapes::torus(0.4, 0.2)) / (4 * pi * pi * 0.4 * 0.2), 1, 0.005);
    EXPECT_NEAR(area(shapes::box({0, 0, 0}, {1, 2, 3})) / 22, 1, 1e-6);
}

TEST(SurfaceSamples, CountFollowsTheKindOfWorld) {
    EvalOptions options;
    EXPECT_EQ(sampleCount(shapes::box({0, 0, 0}, {1, 1, 1}), options), 10000U);
    EXPECT_EQ(sampleCount(shapes::box({0, 0, 0}, {3, 1, 1}), options), 200000U);
    EXPECT_EQ(sampleCount(shapes::box({0, 0, 0}, {6, 5, 2.7F}), options), 1194000U);
    EXPECT_EQ(sampleCount(shapes::box({0, 0, 0}, {40, 36, 9}), options), 2000000U);
    EXPECT_EQ(worldKind(shapes::box({0, 0, 0}, {40, 36, 9}), WorldKind::kAuto),
              WorldKind::kOutdoor);
}

TEST(SurfaceSamples, AMeshWithoutAreaIsRefused) {
    TriangleMesh flat;
    flat.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    flat.triangles = {{0, 1, 2}};
    EXPECT_THROW(groundTruthSamples(flat, {}), std::invalid_argument);
}

TEST(CoverageCurve, HoldsItsLastValue) {
    CoverageCurve curve;
    EXPECT_EQ(curve.areaUnderCurve(10), 0.0);
    curve.add(0.0, 0.5);
    curve.add(1.0, 0.9);
    curve.add(3.5, 1.0);
    EXPECT_DOUBLE_EQ(curve.areaUnderCurve(2), 0.7);
    EXPECT_DOUBLE_EQ(curve.areaUnderCurve(10), (0.5 + 0.9 + 8) / 10);
    EXPECT_EQ(curve.viewsTo(0.9), 2.0);
    EXPECT_EQ(curve.metresTo(0.95), 3.5);
    EXPECT_TRUE(std::isnan(curve.viewsTo(1.01)));
    EXPECT_TRUE(std::isnan(curve.metresTo(1.01)));
}

}  // namespace
}  // namespace riftmap
