// SPDX-License-Identifier: BSD-3-Clause
// Does merging make the surface better, and not only bigger?
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <sstream>

#include "riftmap/graph/pixel_graph.h"
#include "synthetic_views.h"

namespace riftmap {
namespace {

using synthetic::lookDown;
using synthetic::makeView;
using synthetic::Scene;
using synthetic::smallCamera;

/// Root mean square of the distance to z = 0 within the middle of the view.
double planeError(const PixelGraph& graph, double* outliers = nullptr, double limit = 0) {
    double sum = 0, n = 0, far = 0;
    graph.forEachVertexIn({-0.5F, -0.4F, -1}, {0.5F, 0.4F, 1}, [&](VertexId id) {
        const double z = graph.position(id).z();
        sum += z * z;
        n += 1;
        far += std::abs(z) > limit ? 1 : 0;
    });
    if (outliers != nullptr) {
        *outliers = far / n;
    }
    return std::sqrt(sum / n);
}

TEST(Fusion, ErrorOnAPlaneFallsLikeOneOverRootN) {
    Scene scene;
    scene.plane({0, 0, 0}, {0, 0, 1});
    const StereoCamera camera = smallCamera(192, 144);
    const double single = camera.depthSigma(1.5, 0.25);
    PixelGraph graph;
    std::size_t first = 0;
    for (int n = 1; n <= 16; ++n) {
        // Not quite the same pose twice: pixels fall between the vertices.
        const double a = 2.4 * n;
        graph.merge(makeView(scene, camera, lookDown(0.01 * std::cos(a), 0.01 * std::sin(a), 1.5),
                             {0.25, static_cast<std::uint64_t>(n)}));
        if (n == 1) {
            first = graph.vertexCount();
        }
        if (n == 1 || n == 2 || n == 4 || n == 8 || n == 16) {
            double outliers = 0;
            const double error = planeError(graph, &outliers, 5 * single / std::sqrt(n));
            const double expected = single / std::sqrt(n);
            RecordProperty("error_mm_" + std::to_string(n), std::to_string(1e3 * error));
            std::cout << n << " views: " << 1e3 * error << " mm, 1/sqrt(N): " << 1e3 * expected
                      << " mm, beyond 5 sigma: " << outliers << ", vertices " << graph.vertexCount()
                      << '\n';
            EXPECT_NEAR(error, expected, 0.25 * expected) << n << " views";
        }
    }
    // No second sheet: hardly more vertices than the poses' different borders bring.
    EXPECT_LT(static_cast<double>(graph.vertexCount()), 1.04 * static_cast<double>(first));
    double outliers = 0;
    planeError(graph, &outliers, 5 * single / 4);
    EXPECT_LT(outliers, 0.002);
    // The kept sigma tells the truth.
    double sigma = 0, count = 0;
    graph.forEachVertexIn({-0.5F, -0.4F, -1}, {0.5F, 0.4F, 1}, [&](VertexId id) {
        sigma += graph.vertex(id).sigma;
        count += 1;
    });
    EXPECT_NEAR(sigma / count, single / 4, 0.25 * single / 4);
}

TEST(Fusion, FarAndNearViewsOfOneSurfaceMakeOneSurface) {
    Scene scene;
    scene.plane({0, 0, 0}, {0, 0, 1});
    const StereoCamera camera = smallCamera(192, 144);
    PixelGraph graph;
    graph.merge(makeView(scene, camera, lookDown(0, 0, 3.0), {0.2, 1}));
    const double far = planeError(graph);
    graph.merge(makeView(scene, camera, lookDown(0, 0, 1.2), {0.2, 2}));
    graph.merge(makeView(scene, camera, lookDown(0, 0, 3.0), {0.2, 3}));
    graph.merge(makeView(scene, camera, lookDown(0.1, 0, 0.8), {0.2, 4}));
    double outliers = 0;
    const double near = planeError(graph, &outliers, 4 * far / 3);
    std::cout << "far " << 1e3 * far << " mm, in the end " << 1e3 * near << " mm, outliers "
              << outliers << '\n';
    EXPECT_LT(near, 0.35 * far);
    EXPECT_LT(outliers, 0.005);
}

TEST(Fusion, ALoopClosedExactlyStoresTheSurfaceOnce) {
    Scene room;
    room.box({-2, -1.5, 0}, {2, 1.5, 2.5}).box({-0.3, -0.3, 0}, {0.3, 0.3, 1});
    PixelGraph graph;
    std::size_t first = 0;
    constexpr int kViews = 16;
    for (int i = 0; i < 2 * kViews; ++i) {
        const double a = 2 * M_PI * (i % kViews) / kViews;
        const Eigen::Vector3d eye(std::cos(a), 0.8 * std::sin(a), 1.3);
        graph.merge(makeView(room, smallCamera(128, 96), lookAt(eye, 2.0 * eye),
                             {0.05, static_cast<std::uint64_t>(i)}));
        if (i + 1 == kViews) {
            first = graph.vertexCount();
        }
    }
    const double growth = static_cast<double>(graph.vertexCount()) / static_cast<double>(first) - 1;
    std::cout << "second lap: " << 100 * growth << " %\n";
    EXPECT_LE(std::abs(growth), 0.01);
}

/// What a matching window does at silhouettes: background within `radius` pixels of a nearer
/// surface gets the nearer surface's disparity.
void addHalos(View& view, int radius) {
    const DisparityImage before = view.disparity;
    for (int r = 0; r < before.height; ++r) {
        for (int c = 0; c < before.width; ++c) {
            float& d = view.disparity.disparity[before.index(c, r)];
            for (int r2 = std::max(0, r - radius); r2 <= std::min(before.height - 1, r + radius);
                 ++r2) {
                for (int c2 = std::max(0, c - radius); c2 <= std::min(before.width - 1, c + radius);
                     ++c2) {
                    const float other = before.at(c2, r2);
                    if (std::isfinite(other) && other > before.at(c, r) + 3 && other > d) {
                        d = other;
                    }
                }
            }
        }
    }
}

TEST(SeenThrough, HalosGoAndAThinPoleStays) {
    constexpr double kRadius = 0.01, kBox = 0.15;
    Scene scene;
    scene.box({-2, -2, 0}, {2, 2, 2.4})
        .pole({0, 0, 0.8}, kRadius, 1.2)
        .box({0.35, -kBox, 1.0}, {0.35 + 2 * kBox, kBox, 1.4});
    const StereoCamera camera = synthetic::standardCamera();
    // What three standard deviations between two views can tell at the far side of the scene.
    const double limit = 3 * std::sqrt(2.0) * camera.depthSigma(1.6, 0.05);
    PixelGraph graph;
    const auto count = [&](double& pole, double& halo) {
        pole = halo = 0;
        graph.forEachVertexIn({-0.2F, -0.4F, 0.9F}, {0.9F, 0.4F, 1.9F}, [&](VertexId id) {
            const Eigen::Vector3d p = graph.position(id).cast<double>();
            const double toPole = std::abs(std::hypot(p.x(), p.y()) - kRadius);
            const Eigen::Vector3d q = (p - Eigen::Vector3d(0.35 + kBox, 0, 1.2)).cwiseAbs() -
                                      Eigen::Vector3d(kBox, kBox, 0.2);
            const double toBox = std::abs(q.maxCoeff() > 0 ? q.cwiseMax(0.0).norm() : q.maxCoeff());
            const double error = std::min(toPole, toBox);
            pole += toPole < 0.006 ? 1 : 0;
            halo += error > limit ? 1 : 0;
        });
    };
    double pole0 = 0, halo0 = 0, pole = 0, halo = 0;
    // The first look, then four views from around.
    constexpr std::array<double, 5> kAzimuth = {0.3, 0.3 + 1.3, 0.3 + 2.5, 0.3 + 3.8, 0.3 + 5.1};
    for (std::size_t i = 0; i < kAzimuth.size(); ++i) {
        const Eigen::Vector3d middle(0.25, 0, 1.3);
        const Eigen::Vector3d eye =
            middle + 1.4 * Eigen::Vector3d(std::cos(kAzimuth[i]), std::sin(kAzimuth[i]), 0.1);
        View view = makeView(scene, camera, lookAt(eye, middle), {0.05, 50 + i});
        if (i == 0) {
            addHalos(view, 5);
        }
        const MergeResult m = graph.merge(view);
        count(pole, halo);
        if (i == 0) {
            pole0 = pole;
            halo0 = halo;
        }
        std::cout << "view " << i << ": pole " << pole << ", halo " << halo << ", deleted "
                  << m.deletedVertices << '\n';
    }
    EXPECT_GT(halo0, 500);
    EXPECT_LE(halo, 0.05 * halo0);
    EXPECT_GE(pole, 0.99 * pole0);
}

struct Body {
    const char* name;
    Scene scene;
    double area;
};

std::vector<Body> bodiesOfKnownArea() {
    Scene sphere, box, torus;
    sphere.sphere({0, 0, 0}, 0.5);
    box.box({-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3});
    constexpr double kRing = 0.4, kTube = 0.15;
    torus.add([](const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
        // As far as the surface is away at least, again and again.
        for (double t = 0, step = 1; t < 4; t += step) {
            const Eigen::Vector3d p = from + t * direction;
            step = std::hypot(std::hypot(p.x(), p.y()) - kRing, p.z()) - kTube;
            if (step < 1e-6) {
                return t;
            }
        }
        return Scene::kMiss;
    });
    return {{"sphere", sphere, 4 * M_PI * 0.25},
            {"box", box, 6 * 0.36},
            {"torus", torus, 4 * M_PI * M_PI * kRing * kTube}};
}

/// A lap of 26 views from all sides.
void lookFromAllSides(PixelGraph& graph, const Scene& scene, const StereoCamera& camera,
                      double sigma, int lap) {
    std::uint64_t seed = static_cast<std::uint64_t>(26 * lap);
    const auto look = [&](const Eigen::Vector3d& from) {
        graph.merge(
            makeView(scene, camera, lookAt(1.4 * from.normalized(), {0, 0, 0}), {sigma, ++seed}));
    };
    for (const double height : {-1.0, 0.0, 1.0}) {
        for (int i = 0; i < 8; ++i) {
            const double a = 2 * M_PI * (i + 0.3 * height + 0.4 * lap) / 8;
            look({std::cos(a), std::sin(a), height});
        }
    }
    look({0.007, 0, -1});
    look({0.007, 0, 1});
}

void expectArea(const PixelGraph& graph, const Body& body, double sigma) {
    std::cout << body.name << ", sigma " << sigma << ": area " << graph.surfaceArea() / body.area
              << " of the truth\n";
    EXPECT_NEAR(graph.surfaceArea(), body.area, 0.03 * body.area) << body.name;
}

TEST(SurfaceArea, RightHoweverManyViewsOverlap) {
    for (const Body& body : bodiesOfKnownArea()) {
        PixelGraph graph;
        for (int lap = 0; lap < 2; ++lap) {
            lookFromAllSides(graph, body.scene, smallCamera(256, 192), 0.0, lap);
            expectArea(graph, body, 0.0);
        }
    }
}

TEST(SurfaceArea, RightAtTheNoiseOfRenderedPairs) {
    for (const Body& body : bodiesOfKnownArea()) {
        PixelGraph graph;
        lookFromAllSides(graph, body.scene, synthetic::standardCamera(), 0.1, 0);
        expectArea(graph, body, 0.1);
    }
}

TEST(SurfaceArea, OfAWallFromManyPlaces) {
    Scene scene;
    scene.patch({-1, -0.8, 0}, {2, 0, 0}, {0, 1.6, 0});
    PixelGraph graph;
    std::uint64_t seed = 0;
    for (int lap = 0; lap < 3; ++lap) {
        for (const double x : {-0.8, -0.3, 0.2, 0.7}) {
            for (const double y : {-0.5, 0.0, 0.5}) {
                graph.merge(
                    makeView(scene, smallCamera(160, 120),
                             lookAt({x, y, 1.2 + 0.2 * lap}, {x + 0.3 * lap, y - 0.1 * lap, 0.0}),
                             {0.05, ++seed}));
            }
        }
    }
    std::cout << "wall: " << graph.surfaceArea() / 3.2 << " of the truth\n";
    EXPECT_NEAR(graph.surfaceArea(), 3.2, 0.03 * 3.2);
}

TEST(Determinism, SameBytesForOneAndManyThreads) {
    Scene scene;
    scene.box({-1.5, -1.5, 0}, {1.5, 1.5, 2}).sphere({0.2, 0, 0.4}, 0.3);
    std::array<std::string, 2> bytes;
    for (const std::size_t threads : {1U, 4U}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        PixelGraph graph;
        for (int i = 0; i < 8; ++i) {
            const double a = 0.6 * i;
            graph.merge(makeView(scene, smallCamera(128, 96),
                                 lookAt({std::cos(a), std::sin(a), 1.2}, {0, 0, 0.5}),
                                 {0.1, static_cast<std::uint64_t>(i)}));
            graph.rifts();
        }
        std::ostringstream out;
        graph.save(out);
        bytes[threads == 1 ? 0 : 1] = out.str();
    }
    EXPECT_TRUE(bytes[0] == bytes[1]);
}

}  // namespace
}  // namespace riftmap
