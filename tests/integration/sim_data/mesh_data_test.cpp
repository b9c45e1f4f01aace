// SPDX-License-Identifier: BSD-3-Clause
// Meshes that nobody of this project made.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>

#include "riftmap/sim/simulated_platform.h"

namespace riftmap {
namespace {

std::string dataFile(const std::string& name) {
    const char* given = std::getenv("RIFTMAP_DATA");
    const std::filesystem::path root =
        given != nullptr ? given : std::string(RIFTMAP_SOURCE_DIR) + "/../shared/data";
    return (root / name).string();
}

class MeshData : public testing::Test {
 protected:
    void need(const std::string& name) {
        file_ = dataFile(name);
        if (!std::filesystem::exists(file_)) {
            GTEST_SKIP() << "NO DATA: " << file_ << " is missing; set RIFTMAP_DATA";
        }
        options_.world.mesh = file_;
    }
    /// The platform, after a view of it was looked at.
    std::unique_ptr<SimulatedPlatform> explore() {
        options_.noise.level = NoiseOptions::Level::kN0;
        auto platform = makePlatform(options_, 0);
        const StereoObservation view = platform->grab();
        std::size_t valid = 0;
        for (const float d : view.disparity->disparity) {
            valid += std::isfinite(d) ? 1U : 0U;
        }
        EXPECT_GT(valid, 5000U);
        cv::Scalar mean, deviation;
        cv::meanStdDev(view.left, mean, deviation);
        EXPECT_GT(deviation[1], 5) << "a picture of one colour";
        return platform;
    }
    SimulationOptions options_;
    std::string file_;
};

TEST_F(MeshData, ObjectsOfOneMetre) {
    const std::pair<const char*, std::size_t> objects[] = {
        {"objects/stanford_bunny_35k.obj", 69451},
        {"objects/stanford_dragon_res3.ply", 47794},
        {"objects/suzanne.obj", 968},
    };
    for (const auto& [name, triangles] : objects) {
        need(name);
        if (IsSkipped()) {
            return;
        }
        options_.world.meshOptions.size = 1;
        for (options_.platform.startIndex = 0; options_.platform.startIndex < 3;
             ++options_.platform.startIndex) {
            const auto platform = explore();
            EXPECT_EQ(platform->world().mesh.triangles.size(), triangles) << name;
            EXPECT_NEAR(bounds(platform->world().mesh).size().maxCoeff(), 1, 1e-5);
        }
    }
}

TEST_F(MeshData, SmallHouseWithItsTextures) {
    need("world_aws_small_house/aws_small_house.obj");
    if (IsSkipped()) {
        return;
    }
    options_.world.viewSpace = WorldOptions::ViewSpace::kInside;
    const auto platform = explore();
    const TriangleMesh& mesh = platform->world().mesh;
    EXPECT_EQ(mesh.triangles.size(), 145844U);
    EXPECT_NEAR(bounds(mesh).size().x(), 19, 0.1);
    std::size_t textured = 0;
    for (const Material& material : mesh.materials) {
        textured += material.texture.empty() ? 0U : 1U;
    }
    EXPECT_GT(textured, 60U);
    EXPECT_EQ(platform->world().starts.size(), 3U);
}

TEST_F(MeshData, QuadOfEightBuildings) {
    need("world_gazebo_quad/gazebo_quad.obj");
    if (IsSkipped()) {
        return;
    }
    options_.world.viewSpace = WorldOptions::ViewSpace::kInside;
    options_.platform.start = {0, 0, 1.5, 90, 5};
    options_.camera.farLimit = 60;
    const auto platform = explore();
    EXPECT_EQ(platform->world().mesh.triangles.size(), 23854U);
}

}  // namespace
}  // namespace riftmap
