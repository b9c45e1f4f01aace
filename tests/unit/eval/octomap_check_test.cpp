// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/octomap_check.h"

#include <gtest/gtest.h>

#include <cmath>

namespace riftmap {
namespace {

using Points = std::vector<Eigen::Vector3f>;

/// A square of 1 m at x = 2, points 5 mm apart, in the middle of voxels of 5 cm.
Points wall(float x) {
    Points out;
    for (int i = 0; i < 200; ++i) {
        for (int j = 0; j < 200; ++j) {
            out.emplace_back(x, 0.0026F + 0.005F * static_cast<float>(i),
                             0.0026F + 0.005F * static_cast<float>(j));
        }
    }
    return out;
}

const Eigen::Vector3f kEye(0.5F, 0.5F, 0.5F);

TrueSurface truth(const Points& points) {
    return {points, Points(points.size(), Eigen::Vector3f::UnitX())};
}

TEST(OctomapCheck, TheSameCloudAgrees) {
    OctomapCheck check(0.05);
    check.insert(wall(2.025F), kEye);
    const OctomapComparison c = check.compare({wall(2.025F), {}, {}}, truth(wall(2.025F)));
    EXPECT_EQ(c.views, 1U);
    EXPECT_EQ(c.occupied, 400U);
    EXPECT_EQ(c.ours, 400U);
    EXPECT_EQ(c.surfaceVoxels, 400U);
    EXPECT_EQ(c.octomapCoverage(), 1.0);
    EXPECT_EQ(c.ourCoverage(), 1.0);
    EXPECT_EQ(c.vertexCoverage(), 1.0);
    EXPECT_EQ(c.occupiedNotOurs, 0U);
    EXPECT_EQ(c.occupiedOffSurface, 0U);
    EXPECT_EQ(c.oursOffSurface, 0U);
    EXPECT_EQ(c.verticesInFree, 0U);
    EXPECT_EQ(c.verticesInUnknown, 0U);
    EXPECT_GT(c.free, 1000U);
}

TEST(OctomapCheck, HalfAMapIsHalfOfTheVoxels) {
    OctomapCheck check(0.05);
    check.insert(wall(2.025F), kEye);
    Points half = wall(2.025F);
    half.resize(half.size() / 2);
    const OctomapComparison c = check.compare({half, {}, {}}, truth(wall(2.025F)));
    EXPECT_EQ(c.octomapCoverage(), 1.0);
    EXPECT_EQ(c.ourCoverage(), 0.5);
    EXPECT_EQ(c.onlyOccupiedBeside, 20U) << "the row beside the rest";
    EXPECT_EQ(c.onlyOccupiedMissed, 180U);
    EXPECT_EQ(c.onlyOccupiedClipped, 0U);
    EXPECT_EQ(c.occupiedNotOurs, 200U);
    EXPECT_EQ(c.occupiedFarFromOurs, 180U);
    EXPECT_EQ(c.ourCoverageNear(), 0.55);
    const auto owners = check.owners({half, {}, {}}, truth(wall(2.025F)));
    EXPECT_EQ(owners(half.front()), VoxelOwner::kBoth);
    EXPECT_EQ(owners(wall(2.025F).back()), VoxelOwner::kOctomapMissed);
    EXPECT_EQ(owners({3, 3, 3}), VoxelOwner::kNeither);
}

/// Points of a plane that is inclined to all three axes, `spacing` apart over `count`^2 of them.
Points slope(float spacing, std::uint32_t count) {
    Points out;
    for (std::uint32_t i = 0; i < count; ++i) {
        for (std::uint32_t j = 0; j < count; ++j) {
            const float y = spacing * static_cast<float>(i);
            const float z = spacing * static_cast<float>(j);
            out.emplace_back(2.0F + 0.31F * y + 0.23F * z, y, z);
        }
    }
    return out;
}

TEST(OctomapCheck, OurSurfaceRunsThroughTheVoxelsBetweenItsVertices) {
    constexpr std::uint32_t kCount = 33;
    MapSurface map{slope(0.03F, kCount), {}, {}};
    for (std::uint32_t v = kCount; v < map.vertices.size(); ++v) {
        if (v % kCount != 0) {
            map.triangles.push_back({v, v - 1, v - kCount});
            map.triangles.push_back({v - kCount - 1, v - 1, v - kCount});
        }
    }
    const TrueSurface dense = truth(slope(0.003F, 10 * (kCount - 1)));
    const OctomapComparison c = OctomapCheck(0.05).compare(map, dense);
    EXPECT_LT(c.vertexCoverage(), 0.9) << "the plane clips corners of voxels";
    EXPECT_GT(c.ourCoverage(), 0.995);
    EXPECT_LE(c.oursOffSurface, c.surfaceVoxels / 20) << "at the plane's own border";
    const OctomapComparison fine = OctomapCheck(0.02).compare(map, dense);
    EXPECT_EQ(fine.ourCoverage(), fine.vertexCoverage()) << "longer triangles bridge gaps";
}

TEST(OctomapCheck, OurSurfaceIsAsThickAsItsStandardDeviation) {
    const OctomapCheck check(0.05);
    MapSurface map{wall(2.025F), {}, {}};
    EXPECT_EQ(check.compare(map).ours, 400U);
    map.deviations.assign(map.vertices.size(), {0.03F, 0, 0});
    EXPECT_EQ(check.compare(map).ours, 1200U);
    map.deviations.assign(map.vertices.size(), {9, 0, 0});
    EXPECT_EQ(check.compare(map).ours, 1200U) << "a voxel's edge at most";
}

TEST(OctomapCheck, WhyOnlyOneHasAVoxelIsTold) {
    OctomapCheck check(0.05);
    // A ray to a far point carves what we hold at x = 1.525; another ends in a voxel of its own.
    check.insert(Points{{2.525F, 0.525F, 0.525F}}, {0.525F, 0.525F, 0.525F});
    check.insert(Points{{1.525F, 1.525F, 1.525F}}, {1.525F, 1.525F, 0.525F});
    const MapSurface map{{{1.525F, 0.525F, 0.525F}, {5.025F, 5.025F, 5.025F}}, {}, {}};
    TrueSurface surface = truth({{1.525F, 0.525F, 0.525F}, {5.025F, 5.025F, 5.025F}});
    // The truth clips 1 mm of the corner of the voxel that only the OctoMap has.
    surface.points.emplace_back(1.5003F, 1.5003F, 1.5004F);
    surface.normals.push_back(Eigen::Vector3f(1, 1, 1).normalized());
    const OctomapComparison c = check.compare(map, surface);
    EXPECT_EQ(c.surfaceVoxels, 3U);
    EXPECT_EQ(c.onlyOursFree, 1U);
    EXPECT_EQ(c.onlyOursUnknown, 1U);
    EXPECT_EQ(c.onlyOccupiedClipped, 1U);
    EXPECT_EQ(c.onlyOccupiedBeside + c.onlyOccupiedMissed, 0U);
    EXPECT_EQ(c.occupiedOffSurface, 1U);
    EXPECT_EQ(c.occupiedFarOff, 1U);
    const auto owners = check.owners(map, surface);
    EXPECT_EQ(owners(surface.points[0]), VoxelOwner::kOursCarved);
    EXPECT_EQ(owners(surface.points[1]), VoxelOwner::kOursUnknown);
    EXPECT_EQ(owners(surface.points[2]), VoxelOwner::kOctomapClipped);
}

TEST(OctomapCheck, AShiftTakesAWallOffTheBordersOfVoxels) {
    Points rough = wall(2.0F);
    for (std::size_t i = 0; i < rough.size(); ++i) {
        rough[i].x() += i % 2 == 0 ? 1e-4F : -1e-4F;
    }
    for (const float shift : {0.0F, 0.4F}) {
        OctomapCheck check(0.05, Eigen::Vector3f(shift, 0, 0));
        check.insert(rough, kEye);
        const OctomapComparison c = check.compare({rough, {}, {}}, truth(wall(2.00005F)));
        EXPECT_EQ(c.ours, shift > 0 ? 400U : 800U);
        EXPECT_EQ(c.surfaceVoxels, 400U);
        EXPECT_TRUE(check.occupied({2.0F, 0.5F, 0.5F}));
    }
}

TEST(SectionArea, OfPlanesThroughACube) {
    const Eigen::Vector3d low(1, -2, 3);
    const Eigen::Vector3d middle = low + Eigen::Vector3d::Constant(0.25);
    EXPECT_NEAR(sectionArea(low, 0.5, middle, {0, 0, 1}), 0.25, 1e-12);
    EXPECT_NEAR(sectionArea(low, 0.5, middle, Eigen::Vector3d(1, 1, 0).normalized()),
                0.25 * std::sqrt(2), 1e-12);
    EXPECT_NEAR(sectionArea(low, 0.5, middle, Eigen::Vector3d(1, 1, 1).normalized()),
                0.25 * std::sqrt(3) * 0.75, 1e-12)
        << "a regular hexagon";
    // d from a corner along the diagonal: a triangle of sides sqrt(6) d.
    const Eigen::Vector3d diagonal = Eigen::Vector3d(1, 1, 1).normalized();
    EXPECT_NEAR(sectionArea(low, 0.5, low + 0.1 * diagonal, diagonal), std::sqrt(3) / 4 * 6 * 0.01,
                1e-12);
    EXPECT_EQ(sectionArea(low, 0.5, low - 0.1 * diagonal, diagonal), 0);
}

TEST(OctomapCheck, VerticesInTheAirLieInFreeOrUnknownVoxels) {
    OctomapCheck check(0.05);
    check.insert(wall(2.025F), kEye);
    const OctomapComparison c =
        check.compare({{{1.0F, 0.5F, 0.5F}, {5, 5, 5}, {2.025F, 0.5F, 0.5F}}, {}, {}});
    EXPECT_EQ(c.vertices, 3U);
    EXPECT_EQ(c.verticesInFree, 1U);
    EXPECT_EQ(c.verticesFarInFree, 1U);
    EXPECT_EQ(c.verticesInUnknown, 1U);
    EXPECT_TRUE(std::isnan(c.ourCoverage())) << "no truth given";
}

TEST(OctomapCheck, AViewIsItsBackProjectedPixels) {
    View view;
    view.camera.width = 4;
    view.camera.height = 3;
    view.camera.fx = view.camera.fy = 10;
    view.camera.baseline = 0.1;
    view.disparity.resize(4, 3);
    view.disparity.disparity[0] = 0.5F;  // z = 2 m at the principal point
    view.world_T_camera.translation = {1, 2, 3};
    OctomapCheck check(0.05);
    check.insert(view);
    EXPECT_TRUE(check.occupied({1.01F, 2.01F, 5.01F}));
    EXPECT_EQ(check.compare({}).occupied, 1U);
}

TEST(OctomapCheck, AResolutionMustBePositive) {
    EXPECT_THROW(OctomapCheck(0.0), std::invalid_argument);
    EXPECT_THROW(OctomapCheck(std::nan("")), std::invalid_argument);
}

}  // namespace
}  // namespace riftmap
