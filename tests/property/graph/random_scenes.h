// SPDX-License-Identifier: BSD-3-Clause
// Random input for the property tests of the graph.
#pragma once

#include <cstdint>
#include <random>

#include "riftmap/graph/pixel_graph.h"
#include "synthetic_views.h"

namespace riftmap {

using synthetic::Scene;

class Random {
 public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    double in(double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(engine_);
    }
    int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
    Eigen::Vector3d point(double size) {
        return {in(-size, size), in(-size, size), in(-size, size)};
    }
    std::mt19937_64& engine() { return engine_; }

 private:
    std::mt19937_64 engine_;
};

inline Scene randomScene(Random& random) {
    Scene scene;
    scene.box({-2, -2, -1.5}, {2, 2, 1.5});
    for (int i = 0; i < 3; ++i) {
        scene.sphere(random.point(0.6), random.in(0.1, 0.3));
        const Eigen::Vector3d corner = random.point(0.6);
        scene.box(corner, corner + Eigen::Vector3d(random.in(0.02, 0.4), random.in(0.02, 0.4),
                                                   random.in(0.02, 0.4)));
    }
    return scene;
}

inline View randomView(Random& random, const Scene& scene, int width = 64) {
    Eigen::Vector3d eye = random.point(1.0);
    eye.x() += eye.x() < 0 ? -0.8 : 0.8;
    View view = synthetic::makeView(scene, synthetic::smallCamera(width, width * 3 / 4),
                                    lookAt(eye, random.point(0.4)),
                                    {random.below(2) == 0 ? 0.0 : random.in(0.02, 0.3),
                                     static_cast<std::uint64_t>(random.below(1 << 30))});
    for (int i = 0; i < 60; ++i) {  // holes
        view.disparity.disparity[static_cast<std::size_t>(random.below(width * width * 3 / 4))] =
            kNoDisparity;
    }
    return view;
}

inline GraphOptions randomOptions(Random& random) {
    GraphOptions o;
    if (random.below(3) == 0) {
        o.fusion = GraphOptions::Fusion::kFirst;
        o.typedOpenness = false;
        o.delta = random.in(0.05, 0.2);
        o.riftExtent = random.below(2) == 0 ? 0.0 : 1.0;
    } else {
        o.targetResolution = random.in(0.01, 0.1);
        o.riftExtent = random.below(2) == 0 ? 0.5 : 1.0;
    }
    return o;
}

}  // namespace riftmap
