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

TEST(OctomapCheck, TheSameCloudAgrees) {
    OctomapCheck check(0.05);
    check.insert(wall(2.025F), kEye);
    const OctomapComparison c = check.compare(wall(2.025F), wall(2.025F));
    EXPECT_EQ(c.views, 1U);
    EXPECT_EQ(c.occupied, 400U);
    EXPECT_EQ(c.ours, 400U);
    EXPECT_EQ(c.surfaceVoxels, 400U);
    EXPECT_EQ(c.octomapCoverage(), 1.0);
    EXPECT_EQ(c.ourCoverage(), 1.0);
    EXPECT_EQ(c.occupiedWithoutVertex, 0U);
    EXPECT_EQ(c.verticesInFree, 0U);
    EXPECT_EQ(c.verticesInUnknown, 0U);
    EXPECT_GT(c.free, 1000U);
}

TEST(OctomapCheck, HalfAMapIsHalfOfTheVoxels) {
    OctomapCheck check(0.05);
    check.insert(wall(2.025F), kEye);
    Points half = wall(2.025F);
    half.resize(half.size() / 2);
    const OctomapComparison c = check.compare(half, wall(2.025F));
    EXPECT_EQ(c.octomapCoverage(), 1.0);
    EXPECT_EQ(c.ourCoverage(), 0.5);
    EXPECT_EQ(c.onlyOccupied, 200U);
    EXPECT_EQ(c.occupiedWithoutVertex, 200U);
    EXPECT_EQ(c.occupiedFarFromVertex, 180U) << "the row beside the rest is not far";
    EXPECT_EQ(c.ourCoverageNear(), 0.55);
}

TEST(OctomapCheck, VerticesInTheAirLieInFreeOrUnknownVoxels) {
    OctomapCheck check(0.05);
    check.insert(wall(2.025F), kEye);
    const OctomapComparison c =
        check.compare(Points{{1.0F, 0.5F, 0.5F}, {5, 5, 5}, {2.025F, 0.5F, 0.5F}}, {});
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
    EXPECT_EQ(check.compare({}, {}).occupied, 1U);
}

TEST(OctomapCheck, AResolutionMustBePositive) {
    EXPECT_THROW(OctomapCheck(0.0), std::invalid_argument);
    EXPECT_THROW(OctomapCheck(std::nan("")), std::invalid_argument);
}

}  // namespace
}  // namespace riftmap
