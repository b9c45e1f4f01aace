// SPDX-License-Identifier: BSD-3-Clause
// Views of simple worlds whose surface is known exactly: rays against planes, boxes and spheres.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "riftmap/core/camera.h"
#include "riftmap/core/parallel.h"
#include "riftmap/core/pose.h"
#include "riftmap/core/view.h"

namespace riftmap::synthetic {

/// The camera of the project's experiments: 512 x 384, f 420 px, 0.12 m.
inline StereoCamera standardCamera() {
    StereoCamera c;
    c.width = 512;
    c.height = 384;
    c.fx = c.fy = 420;
    c.cx = 255.5;
    c.cy = 191.5;
    c.baseline = 0.12;
    return c;
}

/// The same field of view with fewer pixels, for tests.
inline StereoCamera smallCamera(int width = 96, int height = 72) {
    StereoCamera c = standardCamera();
    const double s = static_cast<double>(width) / c.width;
    c.width = width;
    c.height = height;
    c.fx = c.fy = 420 * s;
    c.cx = (width - 1) / 2.0;
    c.cy = (height - 1) / 2.0;
    return c;
}

/// Surfaces that a ray can meet. World frame [m].
class Scene {
 public:
    /// Distance along a unit direction to the surface, infinite if it misses.
    using Surface =
        std::function<double(const Eigen::Vector3d& origin, const Eigen::Vector3d& dir)>;
    static constexpr double kMiss = std::numeric_limits<double>::infinity();

    Scene& add(Surface surface) {
        surfaces_.push_back(std::move(surface));
        return *this;
    }
    Scene& plane(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
        return add([=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
            const double t = normal.dot(point - o) / normal.dot(d);
            return t > 1e-9 ? t : kMiss;
        });
    }
    /// Parallelogram corner + s a + t b, s and t in [0, 1].
    Scene& patch(const Eigen::Vector3d& corner, const Eigen::Vector3d& a,
                 const Eigen::Vector3d& b) {
        const Eigen::Vector3d n = a.cross(b);
        return add([=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
            const double t = n.dot(corner - o) / n.dot(d);
            if (!(t > 1e-9)) {
                return kMiss;
            }
            const Eigen::Vector3d q = o + t * d - corner;
            const double u = q.cross(b).dot(n) / n.squaredNorm();
            const double v = a.cross(q).dot(n) / n.squaredNorm();
            return u >= 0 && u <= 1 && v >= 0 && v <= 1 ? t : kMiss;
        });
    }
    Scene& sphere(const Eigen::Vector3d& centre, double radius) {
        return add([=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
            const Eigen::Vector3d q = o - centre;
            const double b = q.dot(d), c = q.squaredNorm() - radius * radius, e = b * b - c;
            if (e < 0) {
                return kMiss;
            }
            const double near = -b - std::sqrt(e), far = -b + std::sqrt(e);
            return near > 1e-9 ? near : (far > 1e-9 ? far : kMiss);
        });
    }
    /// Axis-aligned; seen from inside too.
    Scene& box(const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
        return add([=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
            double enter = -kMiss, leave = kMiss;
            for (Eigen::Index i = 0; i < 3; ++i) {
                const double a = (min[i] - o[i]) / d[i], b = (max[i] - o[i]) / d[i];
                enter = std::max(enter, std::min(a, b));
                leave = std::min(leave, std::max(a, b));
            }
            if (!(enter <= leave) || !(leave > 1e-9)) {
                return kMiss;
            }
            return enter > 1e-9 ? enter : leave;
        });
    }
    /// Upright cylinder without ends.
    Scene& pole(const Eigen::Vector3d& foot, double radius, double height) {
        return add([=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
            const Eigen::Vector2d q = (o - foot).head<2>(), e = d.head<2>();
            const double a = e.squaredNorm(), b = q.dot(e), c = q.squaredNorm() - radius * radius;
            const double root = b * b - a * c;
            if (root < 0) {
                return kMiss;
            }
            const double t = (-b - std::sqrt(root)) / a, z = o.z() + t * d.z() - foot.z();
            return t > 1e-9 && z >= 0 && z <= height ? t : kMiss;
        });
    }
    double hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& dir) const {
        double t = kMiss;
        for (const Surface& s : surfaces_) {
            t = std::min(t, s(origin, dir));
        }
        return t;
    }

 private:
    std::vector<Surface> surfaces_;
};

/// Ground folded like a concertina: ridges along y every `fold` metres of x, slopes +-`slope`,
/// lowest at z = 0. Follows rays fold by fold, so it costs the same however large the ground is.
inline Scene foldedGround(double fold = 2.0, double slope = 0.3) {
    Scene scene;
    scene.add([=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
        const double half = fold / 2;
        const int here = static_cast<int>(std::floor(o.x() / half));
        double nearest = Scene::kMiss;
        for (int k = here - 8; k <= here + 8; ++k) {
            const double sign = (k & 1) == 0 ? 1 : -1;
            // z = sign * slope * (x - x0) + z0 on [k half, (k + 1) half]
            const double x0 = k * half, z0 = sign > 0 ? 0 : slope * half;
            const double t =
                (sign * slope * (o.x() - x0) + z0 - o.z()) / (d.z() - sign * slope * d.x());
            const double x = o.x() + t * d.x();
            if (t > 1e-9 && x >= x0 && x <= x0 + half) {
                nearest = std::min(nearest, t);
            }
        }
        return nearest;
    });
    return scene;
}

struct Noise {
    double sigma = 0.0;  ///< of the disparity, Gaussian [px]; also what the view declares
    std::uint64_t seed = 1;
};

/// What the camera sees; pixels that miss the scene or lie farther than `farthest` do not match.
inline View makeView(const Scene& scene, const StereoCamera& camera, const Pose& pose,
                     const Noise& noise = {}, double farthest = 100.0) {
    View view;
    view.camera = camera;
    view.world_T_camera = pose;
    view.disparity.resize(camera.width, camera.height);
    view.image = cv::Mat(camera.height, camera.width, CV_8UC3);
    parallelFor(static_cast<std::size_t>(camera.height), 1, [&](std::size_t first, std::size_t) {
        const int r = static_cast<int>(first);
        std::mt19937_64 random(noise.seed * 0x9E3779B97F4A7C15ULL + static_cast<std::uint64_t>(r));
        std::normal_distribution<double> gauss(0.0, 1.0);
        for (int c = 0; c < camera.width; ++c) {
            const double error = noise.sigma * gauss(random);
            const Eigen::Vector3d ray((c - camera.cx) / camera.fx, (r - camera.cy) / camera.fy, 1);
            const Eigen::Vector3d dir = pose.rotation * ray.normalized();
            const double z = scene.hit(pose.translation, dir) / ray.norm();
            const std::size_t i = view.disparity.index(c, r);
            view.disparity.sigma[i] = static_cast<float>(noise.sigma);
            auto* rgb = view.image.ptr<std::uint8_t>(r) + static_cast<std::ptrdiff_t>(3 * c);
            rgb[0] = rgb[1] = rgb[2] = 0;
            if (z < farthest && camera.disparity(z) + error > 0) {
                view.disparity.disparity[i] = static_cast<float>(camera.disparity(z) + error);
                const Eigen::Vector3d p = pose * Eigen::Vector3d(ray * z);
                for (int k = 0; k < 3; ++k) {
                    rgb[k] =
                        static_cast<std::uint8_t>(128 + 100 * std::sin(3 * p[k] + p[(k + 1) % 3]));
                }
            }
        }
    });
    return view;
}

/// A camera that looks straight down from above (x, y), with its x axis along the map's x.
inline Pose lookDown(double x, double y, double z) {
    Pose pose;
    pose.rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
    pose.translation << x, y, z;
    return pose;
}

/// Poses of a lawn-mower over folded ground, `step` metres apart, from 2.6 m above the valleys:
/// at 512 x 384 a view covers about 3.1 m x 2.3 m.
inline std::vector<Pose> lawnMower(std::size_t views, int perRow, double stepX = 2.4,
                                   double stepY = 1.8) {
    std::vector<Pose> poses;
    for (std::size_t i = 0; i < views; ++i) {
        const int row = static_cast<int>(i) / perRow, k = static_cast<int>(i) % perRow;
        const int column = row % 2 == 0 ? k : perRow - 1 - k;
        poses.push_back(lookDown(column * stepX, row * stepY, 2.6));
    }
    return poses;
}

/// Feeds views over folded ground to `graph` (a PixelGraph) until it has this many vertices;
/// returns the number of views. About 150,000 new vertices a view.
template <class Graph>
std::size_t growTo(Graph& graph, std::size_t vertices, double sigma = 0.05) {
    const Scene scene = foldedGround();
    const StereoCamera camera = standardCamera();
    const int perRow =
        std::max(2, static_cast<int>(std::sqrt(static_cast<double>(vertices) / 150e3 * 0.75)));
    std::size_t views = 0;
    while (graph.vertexCount() < vertices) {
        const Pose pose = lawnMower(views + 1, perRow).back();
        graph.merge(makeView(scene, camera, pose, {sigma, views + 1}));
        ++views;
    }
    return views;
}

}  // namespace riftmap::synthetic
