// SPDX-License-Identifier: BSD-3-Clause
// The ray caster against the slow obvious way: every triangle, one after another.
#include "riftmap/sim/ray_caster.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace riftmap {
namespace {

constexpr std::uint64_t kSeed = 20100503;

class RandomScene : public testing::Test {
 protected:
    RandomScene() {
        for (std::uint32_t i = 0; i < 200; ++i) {
            const Eigen::Vector3d centre = 2 * anywhere();
            for (int k = 0; k < 3; ++k) {
                mesh_.vertices.push_back((centre + 0.4 * anywhere()).cast<float>());
            }
            mesh_.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
        }
        RecordProperty("seed", std::to_string(kSeed));
    }
    Eigen::Vector3d anywhere() {  // in the cube -1 .. 1
        std::uniform_real_distribution<double> u(-1, 1);
        return {u(random_), u(random_), u(random_)};
    }

    /// Moeller-Trumbore, either side.
    std::optional<double> meets(const Eigen::Vector3d& o, const Eigen::Vector3d& d,
                                std::size_t triangle) const {
        const auto c = mesh_.corners(triangle);
        const Eigen::Vector3d e1 = c[1] - c[0];
        const Eigen::Vector3d e2 = c[2] - c[0];
        const Eigen::Vector3d p = d.cross(e2);
        const double det = e1.dot(p);
        const Eigen::Vector3d s = o - c[0];
        const Eigen::Vector3d q = s.cross(e1);
        const double u = s.dot(p) / det;
        const double v = d.dot(q) / det;
        const double t = e2.dot(q) / det;
        if (u < 0 || v < 0 || u + v > 1 || t <= 0) {
            return std::nullopt;
        }
        return t;
    }
    /// Distance from p to a triangle, by a fine net of points on it: at most `step` too large.
    double sampledDistance(const Eigen::Vector3d& p, std::size_t triangle) const {
        const auto c = mesh_.corners(triangle);
        double best = 1e9;
        constexpr int kSteps = 60;
        for (int i = 0; i <= kSteps; ++i) {
            for (int j = 0; i + j <= kSteps; ++j) {
                const Eigen::Vector3d x =
                    c[0] + (c[1] - c[0]) * i / kSteps + (c[2] - c[0]) * j / kSteps;
                best = std::min(best, (x - p).norm());
            }
        }
        return best;
    }

    std::mt19937_64 random_{kSeed};
    TriangleMesh mesh_;
};

TEST_F(RandomScene, BundlesHitWhatSingleRaysHit) {
    const RayCaster caster(mesh_);
    int hits = 0;
    int others = 0;  // at a common edge of two triangles, or where the rounding differs
    for (const std::size_t count : {0U, 1U, 3U, 255U, 256U, 257U, 1000U}) {
        const Eigen::Vector3d o = 3 * anywhere();
        const Eigen::Vector3d middle = -o;
        std::vector<Eigen::Vector3d> directions;
        for (std::size_t i = 0; i < count; ++i) {
            directions.emplace_back(middle + anywhere());
        }
        std::vector<std::optional<Hit>> found(count, Hit());
        caster.castBundle(o, directions, found);
        for (std::size_t i = 0; i < count; ++i) {
            const auto expected = caster.cast(o, directions[i]);
            if (found[i].has_value() != expected.has_value()) {
                ++others;
                continue;
            }
            if (expected) {
                ++hits;
                others += std::abs(found[i]->t - expected->t) > 1e-9 ? 1 : 0;
            }
        }
    }
    EXPECT_GT(hits, 300);
    EXPECT_LE(others, 2);
}

TEST_F(RandomScene, FirstHitIsTheNearestOfAll) {
    const RayCaster caster(mesh_);
    int hits = 0;
    for (int i = 0; i < 5000; ++i) {
        const Eigen::Vector3d o = 3 * anywhere();
        const Eigen::Vector3d d = anywhere() - o * 0.3;
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < mesh_.triangles.size(); ++k) {
            if (const auto t = meets(o, d, k)) {
                nearest = std::min(nearest, *t);
            }
        }
        const auto hit = caster.cast(o, d);
        ASSERT_EQ(hit.has_value(), std::isfinite(nearest)) << "ray " << i;
        if (hit) {
            ++hits;
            EXPECT_NEAR(hit->t, nearest, 1e-5 * (1 + nearest)) << "ray " << i;
            EXPECT_NEAR(std::abs(hit->normal.dot(mesh_.normal(hit->triangle))), 1, 1e-12);
            const auto c = mesh_.corners(hit->triangle);
            const Eigen::Vector3d p =
                (1.0 - hit->u - hit->v) * c[0] + hit->u * c[1] + hit->v * c[2];
            EXPECT_LT((p - (o + hit->t * d)).norm(), 1e-4);
            EXPECT_FALSE(caster.cast(o, d, 0.99 * nearest));
            EXPECT_TRUE(caster.occluded(o, o + 1.01 * nearest * d, 0));
            EXPECT_FALSE(caster.occluded(o, o + nearest * d, 1e-3));
        }
    }
    EXPECT_GT(hits, 500);
}

TEST_F(RandomScene, ClosestIsTheNearestOfAll) {
    const RayCaster caster(mesh_);
    for (int i = 0; i < 100; ++i) {
        const Eigen::Vector3d p = 3 * anywhere();
        double nearest = 1e9;
        for (std::size_t k = 0; k < mesh_.triangles.size(); ++k) {
            nearest = std::min(nearest, sampledDistance(p, k));
        }
        const auto closest = caster.closest(p, 10);
        ASSERT_TRUE(closest);
        EXPECT_NEAR(closest->distance, (closest->point - p).norm(), 1e-12);
        EXPECT_LE(closest->distance, nearest + 1e-9);
        EXPECT_NEAR(closest->distance, nearest, 5e-3);
        EXPECT_LT(sampledDistance(closest->point, closest->triangle), 0.03);
        EXPECT_FALSE(caster.closest(p, 0.99 * closest->distance));
        EXPECT_TRUE(caster.closest(p, 1.01 * closest->distance));
    }
}

TEST_F(RandomScene, SweptDistanceIsTheNearestOfAllPointsOnTheWay) {
    const RayCaster caster(mesh_);
    int clear = 0;
    int touching = 0;
    for (int i = 0; i < 300; ++i) {
        const Eigen::Vector3d a = 3 * anywhere();
        const Eigen::Vector3d b = a + 2 * anywhere();
        constexpr int kSteps = 400;
        const double step = (b - a).norm() / kSteps;
        double nearest = 1;
        for (int k = 0; k <= kSteps; ++k) {
            if (const auto c = caster.closest(a + (b - a) * k / kSteps, 1)) {
                nearest = std::min(nearest, c->distance);
            }
        }
        const double swept = caster.sweptDistance(a, b, 1);
        EXPECT_LE(swept, nearest + 1e-9) << "segment " << i;
        EXPECT_GE(swept, nearest - step) << "segment " << i;
        EXPECT_EQ(caster.sweptClear(a, b, 0.2), swept >= 0.2) << "segment " << i;
        clear += swept >= 0.2 ? 1 : 0;
        touching += swept == 0 ? 1 : 0;
    }
    EXPECT_GT(clear, 20);
    EXPECT_GT(touching, 10);
}

TEST(RayCaster, SharedEdgesAreWatertight) {
    // A fan of triangles around the origin in the plane z = 0; rays aimed exactly at the edges.
    TriangleMesh fan;
    fan.vertices.emplace_back(0, 0, 0);
    constexpr std::uint32_t kSlices = 37;
    for (std::uint32_t i = 0; i < kSlices; ++i) {
        const double angle = 6.283185307179586 * i / kSlices;
        fan.vertices.emplace_back(
            Eigen::Vector3d(std::cos(angle), std::sin(angle), 0).cast<float>());
        fan.triangles.push_back({0, 1 + i, 1 + (i + 1) % kSlices});
    }
    const RayCaster caster(fan);
    for (std::uint32_t i = 0; i < kSlices; ++i) {
        for (int k = 0; k < 99; ++k) {
            const Eigen::Vector3d target = fan.vertices[1 + i].cast<double>() * k / 100;
            const Eigen::Vector3d eye(0.3, -0.2, 1.7);
            const auto hit = caster.cast(eye, target - eye);
            ASSERT_TRUE(hit);
            EXPECT_NEAR(hit->t, 1, 1e-6);
        }
    }
}

TEST(RayCaster, RefusesAMeshThatIsNone) {
    EXPECT_THROW(RayCaster{TriangleMesh{}}, MeshError);
}

}  // namespace
}  // namespace riftmap
