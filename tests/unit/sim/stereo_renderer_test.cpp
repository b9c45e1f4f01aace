// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/stereo_renderer.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "riftmap/sim/simulated_platform.h"

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;

/// A world with its caster, small enough to be rendered often.
struct Studio {
    explicit Studio(WorldOptions::Name name, double noise = 1) {
        WorldOptions options;
        options.name = name;
        options.noise = noise;
        world = makeWorld(options);
        caster = std::make_unique<RayCaster>(world.mesh);
        camera.width = 160;
        camera.height = 120;
        camera.f = 130;
        camera.numDisparities = 32;
        render.sensorNoise = 0;
    }
    StereoRenderer renderer() const { return {world, *caster, camera, render}; }

    World world;
    std::unique_ptr<RayCaster> caster;
    CameraOptions camera;
    RenderOptions render;
};

bool sameBytes(const cv::Mat& a, const cv::Mat& b) {
    return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

TEST(StereoRenderer, DepthAndNormalOfAPlaneAreExact) {
    const Studio studio(WorldOptions::Name::kPlane);
    const auto renderer = studio.renderer();
    const Pose pose = lookAt({-0.3, 0.2, 1.5}, {0.5, 0.1, 0});
    const Truth truth = renderer.truth(pose);
    const StereoCamera camera = renderer.camera();
    int seen = 0;
    for (int row = 0; row < camera.height; ++row) {
        for (int column = 0; column < camera.width; ++column) {
            const Point ray((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, 1);
            const double z = -pose.translation.z() / (pose.rotation * ray).z();  // where it is 0
            const Point place = pose * (z * ray);
            const float depth = truth.depth.at<float>(row, column);
            if (z > 0 && place.head<2>().cwiseAbs().maxCoeff() < 2.99) {
                ASSERT_NEAR(depth, z, 1e-5 * z) << column << ',' << row;
                const auto& n = truth.normals.at<cv::Vec3f>(row, column);
                ASSERT_EQ(n, cv::Vec3f(0, 0, 1));
                ++seen;
            } else if (place.head<2>().cwiseAbs().maxCoeff() > 3.01) {
                ASSERT_TRUE(std::isinf(depth));
            }
        }
    }
    EXPECT_GT(seen, 10000);
}

TEST(StereoRenderer, HalfOcclusionIsWhatTheRightDepthSays) {
    const Studio studio(WorldOptions::Name::kRoom);
    const auto renderer = studio.renderer();
    const StereoCamera camera = renderer.camera();
    const Pose left = studio.world.starts[0].pose();
    const Pose right = left * Pose{Eigen::Matrix3d::Identity(), {camera.baseline, 0, 0}};
    const Truth truth = renderer.truth(left);
    const Truth other = renderer.truth(right, false, false);
    int hidden = 0;
    int checked = 0;
    int wrong = 0;
    for (int row = 0; row < camera.height; ++row) {
        for (int column = 0; column < camera.width; ++column) {
            const auto z = static_cast<double>(truth.depth.at<float>(row, column));
            const double x = column - camera.disparity(z);
            const bool marked = truth.halfOccluded.at<unsigned char>(row, column) != 0;
            if (x < -0.5) {
                EXPECT_TRUE(marked) << "outside the right image";
                continue;
            }
            // Both neighbours in the right image agree: no doubt about this pixel.
            const int a = std::max(0, static_cast<int>(std::floor(x)));
            const int b = std::min(camera.width - 1, a + 1);
            const double za = static_cast<double>(other.depth.at<float>(row, a));
            const double zb = static_cast<double>(other.depth.at<float>(row, b));
            if (std::abs(za - zb) > 0.02 * za) {
                continue;
            }
            ++checked;
            const bool expected = za < 0.95 * z;
            hidden += expected ? 1 : 0;
            wrong += expected != marked ? 1 : 0;
        }
    }
    EXPECT_GT(hidden, 20);
    EXPECT_GT(checked, 10000);
    EXPECT_LE(wrong, checked / 500);
}

TEST(StereoRenderer, TheSamePlaceLooksTheSameFromBothEyes) {
    Studio studio(WorldOptions::Name::kRoom);
    studio.render.vignetting = 0;
    studio.render.colour = false;
    const auto renderer = studio.renderer();
    const StereoCamera camera = renderer.camera();
    const Pose pose = studio.world.starts[0].pose();
    const auto pair = renderer.renderPair(pose, 1);
    const Truth truth = renderer.truth(pose);
    double same = 0;
    double shifted = 0;
    int n = 0;
    for (int row = 0; row < camera.height; ++row) {
        for (int column = 40; column < camera.width - 8; ++column) {
            if (truth.halfOccluded.at<unsigned char>(row, column) != 0) {
                continue;
            }
            const double x =
                column - camera.disparity(static_cast<double>(truth.depth.at<float>(row, column)));
            const auto at = [&](double c) {
                const int a = static_cast<int>(std::floor(c));
                const double w = c - a;
                return (1 - w) * pair.right.at<unsigned char>(row, a) +
                       w * pair.right.at<unsigned char>(row, a + 1);
            };
            const double here = pair.left.at<unsigned char>(row, column);
            same += std::abs(here - at(x));
            shifted += std::abs(here - at(x + 3));
            ++n;
        }
    }
    ASSERT_GT(n, 8000);
    EXPECT_LT(same / n, 3.5) << "grey levels";
    EXPECT_GT(shifted / n, 2.5 * same / n) << "there is something to match";
}

TEST(StereoRenderer, SameBytesForAnyNumberOfThreads) {
    Studio studio(WorldOptions::Name::kRoom);
    studio.render.sensorNoise = 2;
    const Pose pose = studio.world.starts[1].pose();
    StereoRenderer::Pair pairs[2];
    Truth truths[2];
    for (const std::size_t threads : {1U, 2U}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const RayCaster caster(studio.world.mesh);
        const StereoRenderer renderer(studio.world, caster, studio.camera, studio.render);
        pairs[threads - 1] = renderer.renderPair(pose, 9);
        truths[threads - 1] = renderer.truth(pose);
    }
    EXPECT_TRUE(sameBytes(pairs[0].left, pairs[1].left));
    EXPECT_TRUE(sameBytes(pairs[0].right, pairs[1].right));
    EXPECT_TRUE(sameBytes(truths[0].depth, truths[1].depth));
    EXPECT_TRUE(sameBytes(truths[0].halfOccluded, truths[1].halfOccluded));
}

TEST(StereoRenderer, SensorNoiseHasItsDeviationAndItsSeed) {
    Studio studio(WorldOptions::Name::kRoom);
    studio.render.colour = false;
    const Pose pose = studio.world.starts[0].pose();
    const cv::Mat clean = studio.renderer().renderPair(pose, 1).left;
    studio.render.sensorNoise = 4;
    const auto renderer = studio.renderer();
    const auto first = renderer.renderPair(pose, 1);
    cv::Mat difference;
    cv::subtract(first.left, clean, difference, cv::noArray(), CV_32F);
    cv::Scalar mean, deviation;
    cv::meanStdDev(difference, mean, deviation);
    EXPECT_NEAR(mean[0], 0, 0.15);
    EXPECT_NEAR(deviation[0], 4, 0.15);
    EXPECT_TRUE(sameBytes(first.left, renderer.renderPair(pose, 1).left));
    EXPECT_FALSE(sameBytes(first.left, renderer.renderPair(pose, 2).left));
}

TEST(StereoRenderer, BareWallsAreBare) {
    const auto contrast = [](double noise) {
        Studio studio(WorldOptions::Name::kPlane, noise);
        studio.render.colour = false;
        studio.render.vignetting = 0;
        cv::Scalar mean, deviation;
        cv::meanStdDev(studio.renderer().renderPair(studio.world.starts[0].pose(), 1).left, mean,
                       deviation);
        return deviation[0];
    };
    EXPECT_LT(contrast(0), 0.5);
    EXPECT_GT(contrast(1), 10);
    EXPECT_GT(contrast(1), 1.7 * contrast(0.5));
}

TEST(StereoRenderer, TextureFinerThanAPixelBecomesGrey) {
    // A board of squares of 1 cm, black and white, seen from where a pixel is 3 cm.
    Studio studio(WorldOptions::Name::kPlane);
    cv::Mat board(256, 256, CV_8UC3);
    for (int r = 0; r < 256; ++r) {
        for (int c = 0; c < 256; ++c) {
            board.at<cv::Vec3b>(r, c) = cv::Vec3b::all((r + c) % 2 == 0 ? 255 : 0);
        }
    }
    TriangleMesh& mesh = studio.world.mesh;
    mesh.materials.assign(1, Material());
    mesh.materials[0].texture = board;
    mesh.materialOf.assign(mesh.triangles.size(), 0);
    for (const auto& v : mesh.vertices) {
        mesh.uv.emplace_back(v.x() / 2.56F, v.y() / 2.56F);
    }
    studio.render.vignetting = 0;
    studio.render.colour = false;
    const auto view = [&](double height) {
        return studio.renderer().renderPair(lookAt({0.01, 0.02, height}, {0.01, 0.02, 0}), 1).left;
    };
    cv::Scalar mean, deviation;
    cv::meanStdDev(view(3.9)(cv::Rect(40, 20, 80, 80)), mean, deviation);
    EXPECT_LT(deviation[0], 3);
    const double grey = mean[0];
    cv::meanStdDev(view(0.15), mean, deviation);  // a square is 8 pixels, its edges are soft
    EXPECT_GT(deviation[0], 35);
    EXPECT_NEAR(mean[0], grey, 8);
}

TEST(StereoRenderer, ALensThatDistortsIsRectifiedAway) {
    SimulationOptions options;
    options.render.sensorNoise = 0;
    options.render.vignetting = 0;
    const auto ideal = makePlatform(options, 0)->grab();
    options.camera.distortion = {-0.2, 0.05, 0.001, -0.0005, 0.01};
    const auto platform = makePlatform(options, 0);
    const auto rectified = platform->grab();
    const auto raw = platform->renderer().renderPair(platform->pose(), 0);
    // Away from the border, which the distorted image does not reach.
    const cv::Rect middle(60, 45, 392, 294);
    cv::Mat difference;
    cv::absdiff(rectified.left(middle), ideal.left(middle), difference);
    const double withRectification = cv::mean(difference.reshape(1))[0];
    cv::absdiff(raw.left(middle), ideal.left(middle), difference);
    const double without = cv::mean(difference.reshape(1))[0];
    EXPECT_LT(withRectification, 4);
    EXPECT_GT(without, 3 * withRectification);
}

}  // namespace
}  // namespace riftmap
