// SPDX-License-Identifier: BSD-3-Clause
// What a view saw through.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "riftmap/core/parallel.h"
#include "riftmap/planner/free_space.h"

namespace riftmap {

namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

/// Depths of a view for questions about rectangles: least depth and share of measured pixels.
class DepthRectangles {
 public:
    DepthRectangles(const View& view, const EmptyPixels& empty)
        : width_(view.disparity.width), height_(view.disparity.height) {
        const auto n = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
        std::vector<float> depth(n, kFar);
        measured_.assign(
            static_cast<std::size_t>(width_ + 1) * static_cast<std::size_t>(height_ + 1), 0);
        for (int row = 0; row < height_; ++row) {
            int inRow = 0;
            for (int column = 0; column < width_; ++column) {
                const std::size_t i = view.disparity.index(column, row);
                const bool valid = view.disparity.valid(column, row);
                if (valid) {
                    depth[i] = static_cast<float>(
                        view.camera.depth(static_cast<double>(view.disparity.disparity[i])));
                } else if (empty.depth[i] > 0) {
                    depth[i] = empty.depth[i];
                }
                inRow += valid || empty.proven[i] != 0 ? 1 : 0;
                measured_[sum(column + 1, row + 1)] = measured_[sum(column + 1, row)] + inRow;
            }
        }
        levels_.push_back({width_, height_, std::move(depth)});
        while (levels_.back().width > 1 && levels_.back().height > 1) {
            levels_.push_back(halved(levels_.back()));
        }
    }

    /// Least depth over the pixels [c0, c1] x [r0, r1], or a little more than them; pixels that
    /// show nothing do not count.
    float least(int c0, int r0, int c1, int r1) const {
        int level = 0;
        while (std::max((c1 >> level) - (c0 >> level), (r1 >> level) - (r0 >> level)) > 3 &&
               level + 1 < static_cast<int>(levels_.size())) {
            ++level;
        }
        const Level& l = levels_[static_cast<std::size_t>(level)];
        float z = kFar;
        for (int r = r0 >> level; r <= std::min(r1 >> level, l.height - 1); ++r) {
            for (int c = c0 >> level; c <= std::min(c1 >> level, l.width - 1); ++c) {
                z = std::min(
                    z, l.depth[static_cast<std::size_t>(r) * static_cast<std::size_t>(l.width) +
                               static_cast<std::size_t>(c)]);
            }
        }
        return z;
    }
    double measuredShare(int c0, int r0, int c1, int r1) const {
        const int n = measured_[sum(c1 + 1, r1 + 1)] - measured_[sum(c0, r1 + 1)] -
                      measured_[sum(c1 + 1, r0)] + measured_[sum(c0, r0)];
        return n / static_cast<double>((c1 - c0 + 1) * (r1 - r0 + 1));
    }

 private:
    struct Level {
        int width, height;
        std::vector<float> depth;
    };
    static Level halved(const Level& fine) {
        Level coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
        coarse.depth.assign(
            static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height), kFar);
        for (int r = 0; r < fine.height; ++r) {
            for (int c = 0; c < fine.width; ++c) {
                float& z = coarse.depth[static_cast<std::size_t>(r / 2) *
                                            static_cast<std::size_t>(coarse.width) +
                                        static_cast<std::size_t>(c / 2)];
                z = std::min(
                    z,
                    fine.depth[static_cast<std::size_t>(r) * static_cast<std::size_t>(fine.width) +
                               static_cast<std::size_t>(c)]);
            }
        }
        return coarse;
    }
    std::size_t sum(int column, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_ + 1) +
               static_cast<std::size_t>(column);
    }

    int width_, height_;
    std::vector<Level> levels_;
    std::vector<int> measured_;  ///< integral image of the measured pixels
};

/// What lies before the camera within the image and the range, give or take a pixel.
class ViewPyramid {
 public:
    ViewPyramid(const StereoCamera& c, int firstColumn, double farLimit)
        : faces_{Eigen::Vector4d(0, 0, 1, 0),
                 Eigen::Vector4d(0, 0, -1, farLimit),
                 Eigen::Vector4d(c.fx, 0, c.cx - firstColumn + 1, 0),
                 Eigen::Vector4d(-c.fx, 0, c.width - c.cx, 0),
                 Eigen::Vector4d(0, c.fy, c.cy + 1, 0),
                 Eigen::Vector4d(0, -c.fy, c.height - c.cy, 0)} {}

    /// Of the points first + i * step, i < n, in the camera's frame: the range of i that may be
    /// inside, with one more at either end.
    std::pair<int, int> clip(const Eigen::Vector3d& first, const Eigen::Vector3d& step,
                             int n) const {
        double low = 0;
        double high = n;
        for (const Eigen::Vector4d& face : faces_) {
            const double at = face.head<3>().dot(first) + face.w();
            const double slope = face.head<3>().dot(step);
            if (std::abs(slope) < 1e-9) {
                high = at < -1e-6 ? -1 : high;
            } else if (slope > 0) {
                low = std::max(low, -at / slope);
            } else {
                high = std::min(high, -at / slope);
            }
        }
        low = std::min<double>(low, n);
        high = std::max(high, -1.0);
        const int begin = std::max(0, static_cast<int>(std::floor(low)) - 1);
        const int end = std::min(n, static_cast<int>(std::ceil(high)) + 2);
        return {begin, std::max(begin, end)};
    }

 private:
    std::array<Eigen::Vector4d, 6> faces_;  ///< inside where xyz . p + w >= 0
};

}  // namespace

void FreeSpace::carve(const View& view, const SensorModel& sensor, const EmptyPixels& empty) {
    const DepthRectangles depth(view, empty);
    const std::uint8_t done = sensor.exactDepth() ? kProvenBit : kFreeBit;
    const StereoCamera& camera = view.camera;
    const Pose camera_T_world = view.world_T_camera.inverse();
    const double radius = 0.87 * voxel_;  // of the ball around a voxel
    constexpr double kMeasured = 0.8;     // of the pixels over a voxel that is called free
    const int firstColumn = view.disparity.firstColumn;
    const int width = view.disparity.width;
    const int height = view.disparity.height;
    const ViewPyramid pyramid(camera, firstColumn, sensor.farLimit);
    parallelForEach(size_.z(), 1, [&](int z) {
        for (int y = 0; y < size_.y(); ++y) {
            const Eigen::Vector3d first = camera_T_world * centre({0, y, z});
            const Eigen::Vector3d step = camera_T_world.rotation.col(0) * voxel_;
            const auto [begin, end] = pyramid.clip(first, step, size_.x());
            Eigen::Vector3d p = first + begin * step;
            std::size_t i = index({begin, y, z});
            for (int x = begin; x < end; ++x, ++i, p += step) {
                if (p.z() < radius || p.z() > sensor.farLimit || (voxels_[i] & done) != 0) {
                    continue;
                }
                const Eigen::Vector2d uv = camera.project(p);
                const double px = camera.fx * radius / p.z();
                const int c0 = static_cast<int>(std::floor(uv.x() - px));
                const int c1 = static_cast<int>(std::ceil(uv.x() + px));
                const int r0 = static_cast<int>(std::floor(uv.y() - px));
                const int r1 = static_cast<int>(std::ceil(uv.y() + px));
                const int c = static_cast<int>(std::lround(uv.x()));
                const int r = static_cast<int>(std::lround(uv.y()));
                if (c < firstColumn || r < 0 || c >= width || r >= height) {
                    continue;
                }
                // A voxel that the surface cuts is never free as a whole, and need not hold
                // a vertex: it is known nevertheless.
                const float at = depth.least(c, r, c, r);
                const std::size_t pixel = view.disparity.index(c, r);
                const bool measured = view.disparity.valid(c, r) || empty.proven[pixel] != 0;
                if ((measured || empty.depth[pixel] > 0) &&
                    p.z() < static_cast<double>(at) + 0.5 * voxel_) {
                    voxels_[i] |= measured ? kKnownBit | kMiddleBit : kKnownBit;
                    if (p.z() < static_cast<double>(at)) {
                        voxels_[i] |= kSeenBit;
                    }
                }
                // Near the camera few voxels are in the image as a whole. Of one whose
                // middle is, what sticks out borders on a voxel that is not free, and keeps
                // the distance that is kept to that one.
                const int a = std::max(c0, firstColumn);
                const int b = std::max(r0, 0);
                const int e = std::min(c1, width - 1);
                const int f = std::min(r1, height - 1);
                const double share = depth.measuredShare(a, b, e, f);
                if (share >= kMeasured &&
                    static_cast<double>(depth.least(a, b, e, f)) > p.z() + radius) {
                    const bool whole = a == c0 && b == r0 && e == c1 && f == r1;
                    voxels_[i] |= whole && share == 1.0 ? kFreeBit | kProvenBit : kFreeBit;
                }
            }
        }
    });
}

}  // namespace riftmap
