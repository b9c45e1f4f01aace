// SPDX-License-Identifier: BSD-3-Clause
// A wall with a few balls and plates before it: steps of all depths, rims, hidden places.
#pragma once

#include <optional>
#include <random>
#include <vector>

#include "planner_scene.h"

namespace riftmap::test {

struct RandomScene {
    explicit RandomScene(std::uint32_t seed) : random(seed) {
        for (int i = 0; i < 5; ++i) {
            balls.push_back(
                {{uniform(1.2, 2.4), uniform(-1.0, 1.0), uniform(-0.7, 0.7)}, uniform(0.08, 0.3)});
        }
        for (const double step : {0.06, 0.1, 0.14}) {
            plates.emplace_back(2.5 - step, uniform(-0.9, 0.5), uniform(-0.6, 0.3));
        }
    }

    double uniform(double a, double b) {
        return a + (b - a) * static_cast<double>(random()) / 4294967296.0;
    }
    Eigen::Vector3d place(const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
        return {uniform(min.x(), max.x()), uniform(min.y(), max.y()), uniform(min.z(), max.z())};
    }
    /// Distance in lengths of the direction.
    std::optional<double> depthAlong(const Eigen::Vector3d& origin,
                                     const Eigen::Vector3d& direction) const {
        std::optional<double> best = wall(2.5)(origin, direction);
        for (const Eigen::Vector3d& plate : plates) {
            const auto s = wall(plate.x())(origin, direction);
            const Eigen::Vector3d at = origin + s.value_or(0) * direction - plate;
            if (s && at.y() > 0 && at.y() < 0.4 && at.z() > 0 && at.z() < 0.3) {
                best = std::min(*best, *s);
            }
        }
        for (const Ball& ball : balls) {
            const Eigen::Vector3d to = origin - ball.centre;
            const double a = direction.squaredNorm();
            const double b = to.dot(direction);
            const double root = b * b - a * (to.squaredNorm() - ball.radius * ball.radius);
            const double s = root < 0 ? -1.0 : (-b - std::sqrt(root)) / a;
            if (s > 0 && (!best || s < *best)) {
                best = s;
            }
        }
        return best;
    }
    View see(const Pose& pose) const {
        return viewOf(pose, [this](const Eigen::Vector3d& origin, const Eigen::Vector3d& d) {
            return depthAlong(origin, d);
        });
    }

    struct Ball {
        Eigen::Vector3d centre;
        double radius;
    };
    std::mt19937 random;
    std::vector<Ball> balls;
    std::vector<Eigen::Vector3d> plates;  ///< a corner each; 0.4 x 0.3 m, parallel to the wall
};

}  // namespace riftmap::test
