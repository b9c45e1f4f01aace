// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/seen_through.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace riftmap {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr float kSigmas = 2;
constexpr double kNearest = 0.05;  // [m] before the camera
constexpr int kTile = 32;  // [px] edge of the pieces of an image that are known by their farthest

}  // namespace

struct SeenThrough::Depths {
    StereoCamera camera;
    Pose camera_T_world;
    std::vector<float> depth;     ///< up to which was seen through; 0: not known
    std::vector<float> farthest;  ///< of each tile, row by row

    int tileColumns() const { return (camera.width + kTile - 1) / kTile; }
    std::size_t pixel(int row, int column) const { return at(row, column, camera.width); }
    std::size_t tile(int row, int column) const { return at(row, column, tileColumns()); }
    void findFarthest();
    bool reachInto(const Eigen::AlignedBox3d& box) const;

 private:
    static std::size_t at(int row, int column, int columns) {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
               static_cast<std::size_t>(column);
    }
};

void SeenThrough::Depths::findFarthest() {
    const int rows = (camera.height + kTile - 1) / kTile;
    farthest.assign(tile(rows, 0), 0.0F);
    for (int row = 0; row < camera.height; ++row) {
        for (int column = 0; column < camera.width; ++column) {
            float& most = farthest[tile(row / kTile, column / kTile)];
            most = std::max(most, depth[pixel(row, column)]);
        }
    }
}

/// By the ball around the box: false only if no place in it was seen through.
bool SeenThrough::Depths::reachInto(const Eigen::AlignedBox3d& box) const {
    const Eigen::Vector3d p = camera_T_world * Eigen::Vector3d(box.center());
    const double radius = box.diagonal().norm() / 2;
    const double front = p.z() - radius;
    if (p.z() + radius < kNearest) {
        return false;
    }
    if (front < kNearest) {
        return true;
    }
    // A place at the ball's side projects between those of its front and its back.
    const auto tiles = [&](double middle, double f, double c, int pixels) {
        const double low = middle - radius;
        const double high = middle + radius;
        const double first = f * std::min(low / front, low / (p.z() + radius)) + c;
        const double last = f * std::max(high / front, high / (p.z() + radius)) + c;
        const double most = pixels - 1;
        return first > most + 1 || last < -1
                   ? std::pair(0, -1)
                   : std::pair(static_cast<int>(std::clamp(first - 1, 0.0, most)) / kTile,
                               static_cast<int>(std::clamp(last + 1, 0.0, most)) / kTile);
    };
    const auto [left, right] = tiles(p.x(), camera.fx, camera.cx, camera.width);
    const auto [top, bottom] = tiles(p.y(), camera.fy, camera.cy, camera.height);
    for (int row = top; row <= bottom; ++row) {
        for (int column = left; column <= right; ++column) {
            if (static_cast<double>(farthest[tile(row, column)]) > front) {
                return true;
            }
        }
    }
    return false;
}

SeenThrough::SeenThrough() = default;
SeenThrough::~SeenThrough() = default;

void SeenThrough::add(const View& view, const EmptyPixels& empty) {
    const DisparityImage& d = view.disparity;
    Depths depths{view.camera, view.world_T_camera.inverse(), empty.depth, {}};
    const double scale = view.camera.fx * view.camera.baseline;
    for (int row = 0; row < d.height; ++row) {
        for (int column = d.firstColumn; column < d.width; ++column) {
            const std::size_t i = d.index(column, row);
            if (d.valid(column, row)) {
                const auto z =
                    static_cast<float>(view.camera.depth(static_cast<double>(d.disparity[i])));
                const float sigma = z * z * d.sigma[i] / static_cast<float>(scale);
                depths.depth[i] = z - kSigmas * sigma;
            }
        }
    }
    depths.findFarthest();
    views_.push_back(std::move(depths));
}

SeenThrough::Views SeenThrough::into(const Eigen::AlignedBox3d& box) const {
    Views some;
    std::for_each(views_.rbegin(), views_.rend(), [&](const Depths& v) {
        if (v.reachInto(box)) {
            some.depths_.push_back(&v);
        }
    });
    return some;
}

bool SeenThrough::Views::seeThrough(const Eigen::Vector3d& place) const {
    // The newest view is the likeliest to know.
    return std::any_of(depths_.begin(), depths_.end(), [&](const Depths* v) {
        const Eigen::Vector3d p = v->camera_T_world * place;
        if (p.z() < kNearest) {
            return false;
        }
        const Eigen::Vector2d uv = v->camera.project(p);
        const auto column = static_cast<int>(std::lround(uv.x()));
        const auto row = static_cast<int>(std::lround(uv.y()));
        return column >= 0 && row >= 0 && column < v->camera.width && row < v->camera.height &&
               p.z() < static_cast<double>(v->depth[v->pixel(row, column)]);
    });
}

std::optional<Gap> gapBeside(const PixelGraph& graph, const SeenThrough::Views& seen,
                             const Eigen::Vector3d& rim, const Eigen::Vector3d& normal,
                             const Eigen::Vector3d& outward, double resolution) {
    constexpr std::array<double, 3> kDistances = {1.5, 2.5, 1 + kWidestGap};  // [resolutions]
    constexpr double kStep = kPi / 12;
    constexpr int kFarthest = 7;  // [steps] from straight on: another surface may stand on the rim
    const auto nearby = static_cast<float>(0.75 * resolution);
    std::optional<Gap> gap;
    for (const double distance : kDistances) {
        const double radius = distance * resolution;
        bool free = false;
        constexpr int kNone = kFarthest + 1;
        int dark = kNone;  // step of the first unknown place
        for (int step = kFarthest; step >= -kFarthest && !(free && dark != kNone); --step) {
            const Eigen::Vector3d place =
                rim + radius * (std::cos(step * kStep) * outward + std::sin(step * kStep) * normal);
            if (seen.seeThrough(place)) {
                free = true;
                dark = kNone;
            } else if (free || (dark == kNone && step <= 0)) {
                if (!graph.anyWithin(place.cast<float>(), nearby)) {
                    dark = step;
                } else if (free) {
                    break;
                }
            }
        }
        if (dark == kNone) {
            break;
        }
        // Straight on the map has the surface's other side.
        const auto ahead = graph.nearest((rim + radius * outward).cast<float>(), nearby);
        if (ahead && graph.vertex(*ahead).normal.cast<double>().dot(normal) < -0.5) {
            break;
        }
        if (!gap) {
            const double angle = dark * kStep;
            gap = Gap{0, rim + radius * (std::cos(angle) * outward + std::sin(angle) * normal),
                      std::cos(angle) * normal - std::min(std::sin(angle), 0.0) * outward};
        }
        gap->width = radius - resolution;
    }
    return gap;
}

}  // namespace riftmap
