// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/world.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <fstream>
#include <random>

#include "riftmap/sim/ray_caster.h"

namespace riftmap {
namespace {

using Name = WorldOptions::Name;
using Point = Eigen::Vector3d;

World make(Name name) {
    WorldOptions options;
    options.name = name;
    return makeWorld(options);
}

class BuiltIn : public testing::TestWithParam<Name> {};

TEST_P(BuiltIn, StartsAreInTheWorkspaceAndClear) {
    const World world = make(GetParam());
    const RayCaster caster(world.mesh);
    ASSERT_GE(world.starts.size(), 3U);
    for (const StartPose& start : world.starts) {
        EXPECT_TRUE(world.workspace.contains(start.position)) << start.position.transpose();
        EXPECT_FALSE(caster.closest(start.position, 0.4)) << start.position.transpose();
        EXPECT_TRUE(isValid(start.pose()));
        const Pose pose = start.pose();
        int seen = 0;
        for (const double x : {-0.3, -0.1, 0.1, 0.3}) {
            for (const double y : {-0.3, -0.1, 0.1, 0.3}) {
                seen += caster.cast(pose.translation, pose.rotation * Point(x, y, 1)) ? 1 : 0;
            }
        }
        EXPECT_GE(seen, 5) << "looks at next to nothing";
    }
}

TEST_P(BuiltIn, ShowsItsFrontToWhoeverCanSeeIt) {
    // From the starts, straight and once reflected, no ray may meet the back of a triangle.
    const World world = make(GetParam());
    const RayCaster caster(world.mesh);
    std::mt19937_64 random(5);
    std::normal_distribution<double> gauss;
    std::uniform_real_distribution<double> uniform;
    const auto anyDirection = [&] {
        return Point(gauss(random), gauss(random), gauss(random)).normalized();
    };
    const Bounds box = bounds(world.mesh);
    const auto anyPlace = [&] {
        return Point(
            box.min +
            Point(uniform(random), uniform(random), uniform(random)).cwiseProduct(box.size()));
    };
    int hits = 0;
    int backs = 0;
    for (int i = 0; i < 9000; ++i) {
        Point from = world.starts[static_cast<std::size_t>(i) % 3].position;
        Point direction = anyPlace() - from;
        for (int bounce = 0; bounce < 3; ++bounce) {
            const auto hit = caster.cast(from, direction);
            if (!hit) {
                break;
            }
            ++hits;
            if (hit->normal.dot(direction) > 0) {
                ++backs;
                break;
            }
            from += (hit->t - 1e-3 / direction.norm()) * direction;
            const Point next = anyDirection();
            direction = next.dot(hit->normal) > 0 ? next : Point(-next);
        }
    }
    EXPECT_GT(hits, 1000);
    EXPECT_LE(backs, hits / 1000) << "of " << hits;  // hairline cracks where two solids touch
}

TEST_P(BuiltIn, IsTheSameEveryTime) {
    EXPECT_EQ(hashOf(make(GetParam()).mesh), hashOf(make(GetParam()).mesh));
}

INSTANTIATE_TEST_SUITE_P(Worlds, BuiltIn,
                         testing::Values(Name::kRoom, Name::kRooms, Name::kCourtyard,
                                         Name::kSculpture, Name::kPlane, Name::kSteps));

TEST(World, RoomsHaveNoHoles) {
    for (const Name name : {Name::kRoom, Name::kRooms}) {
        const World world = make(name);
        const RayCaster caster(world.mesh);
        std::mt19937_64 random(6);
        std::normal_distribution<double> gauss;
        for (int i = 0; i < 20000; ++i) {
            const Point direction(gauss(random), gauss(random), gauss(random));
            ASSERT_TRUE(caster.cast(world.starts[0].position, direction)) << direction.transpose();
        }
    }
}

TEST(World, SizesAreAsAnnounced) {
    EXPECT_TRUE(bounds(make(Name::kRoom).mesh).size().isApprox(Point(6, 5, 2.7), 1e-6));
    EXPECT_TRUE(
        make(Name::kCourtyard).workspace.size().head<2>().isApprox(Eigen::Vector2d(40, 36)));
    const double sculpture = bounds(make(Name::kSculpture).mesh).size().maxCoeff();
    EXPECT_GT(sculpture, 0.8);
    EXPECT_LT(sculpture, 1.2);
    EXPECT_NEAR(area(make(Name::kPlane).mesh), 36, 1e-9);
}

TEST(World, NoiseIsAnOption) {
    WorldOptions options;
    options.noise = 0;
    for (const Material& material : makeWorld(options).mesh.materials) {
        EXPECT_EQ(material.noise, 0);
    }
}

TEST(StartPose, LooksWhereItSays) {
    const StartPose start{{1, 2, 3}, 0.5, 0.2};
    const Pose pose = start.pose();
    EXPECT_TRUE(isValid(pose));
    EXPECT_TRUE(pose.rotation.col(2).isApprox(
        Point(std::cos(0.2) * std::cos(0.5), std::cos(0.2) * std::sin(0.5), std::sin(0.2))));
    EXPECT_LT(pose.rotation(2, 1), 0) << "the image's y axis points down";
    EXPECT_NEAR(pose.rotation(2, 0), 0, 1e-15) << "no roll";
    const StartPose back = StartPose::towards({1, 2, 3}, Point(1, 2, 3) + 2 * pose.rotation.col(2));
    EXPECT_NEAR(back.yaw, 0.5, 1e-12);
    EXPECT_NEAR(back.pitch, 0.2, 1e-12);
    EXPECT_TRUE(isValid((StartPose{{0, 0, 1}, 0.3, -1.5707963267948966}.pose())));
}

/// A cube of side 2 around (5, 0, 1), fronts outwards, in a file.
std::string cubeFile(const std::string& name) {
    const std::string file = testing::TempDir() + name;
    std::ofstream out(file);
    for (int i = 0; i < 8; ++i) {
        out << "v " << 4 + 2 * (i & 1) << ' ' << -1 + (i & 2) << ' ' << (i & 4) / 2 << '\n';
    }
    out << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    return file;
}

TEST(World, ViewSpaceOfAnObjectIsAroundIt) {
    WorldOptions options;
    options.mesh = cubeFile("around.obj");
    options.margin = 1.5;
    const World world = makeWorld(options);
    EXPECT_TRUE(world.workspace.min.isApprox(Point(2.5, -2.5, -1.5)));
    EXPECT_TRUE(world.workspace.max.isApprox(Point(7.5, 2.5, 3.5)));
    const RayCaster caster(world.mesh);
    ASSERT_EQ(world.starts.size(), 3U);
    for (const StartPose& start : world.starts) {
        EXPECT_TRUE(world.workspace.contains(start.position));
        const auto hit = caster.cast(start.position, start.pose().rotation.col(2));
        ASSERT_TRUE(hit);
        EXPECT_GT(hit->t, 0.6);
        EXPECT_LT(hit->normal.dot(start.pose().rotation.col(2)), 0);
    }
}

TEST(World, ViewSpaceOfABuildingIsInsideIt) {
    WorldOptions options;
    options.mesh = cubeFile("inside.obj");
    options.meshOptions.scale = 3;
    options.viewSpace = WorldOptions::ViewSpace::kInside;
    const World world = makeWorld(options);
    EXPECT_TRUE(world.workspace.max.isApprox(Point(18, 3, 6)));
    ASSERT_GE(world.starts.size(), 1U);
    const RayCaster caster(world.mesh);
    for (const StartPose& start : world.starts) {
        EXPECT_TRUE(world.workspace.contains(start.position));
        EXPECT_FALSE(caster.closest(start.position, 0.5));
    }
}

}  // namespace
}  // namespace riftmap
