// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/seen_through.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace riftmap {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr float kSigmas = 2;

/// A row's pixels without a match before which nothing is, by their neighbours: the strip beside a
/// step that one camera alone sees is as wide as the step in disparity, and a surface that is too
/// near has the greatest disparities beside it.
void openBackground(const DisparityImage& d, int row, float farLimit, std::vector<float>& depth) {
    constexpr float kWindow = 8;     // [px] that matching may add to such a strip
    constexpr float kAlmost = 0.9F;  // of the greatest disparity
    for (int begin = d.firstColumn; begin < d.width; ++begin) {
        if (d.valid(begin, row)) {
            continue;
        }
        int end = begin;
        while (end < d.width && !d.valid(end, row)) {
            ++end;
        }
        const float left = begin > d.firstColumn ? d.at(begin - 1, row) : 0.0F;
        const float right = end < d.width ? d.at(end, row) : 0.0F;
        const bool hole = begin > d.firstColumn && end < d.width;
        const bool tooNear = std::max(left, right) > kAlmost * d.maxDisparity;
        const bool oneSided =
            hole && static_cast<float>(end - begin) <= std::abs(right - left) + kWindow;
        if (!tooNear && !oneSided) {
            std::fill(
                depth.begin() + static_cast<std::ptrdiff_t>(d.index(begin, row)),
                depth.begin() + static_cast<std::ptrdiff_t>(d.index(begin, row)) + end - begin,
                farLimit);
        }
        begin = end;
    }
}

}  // namespace

void SeenThrough::add(const View& view, const SensorModel& sensor, bool backgroundIsFree) {
    const DisparityImage& d = view.disparity;
    Depths depths{view.camera, view.world_T_camera.inverse(), {}};
    depths.depth.assign(d.disparity.size(), 0.0F);
    const double scale = view.camera.fx * view.camera.baseline;
    for (int row = 0; row < d.height; ++row) {
        for (int column = d.firstColumn; column < d.width; ++column) {
            if (d.valid(column, row)) {
                const std::size_t i = d.index(column, row);
                const auto z =
                    static_cast<float>(view.camera.depth(static_cast<double>(d.disparity[i])));
                const float sigma = z * z * d.sigma[i] / static_cast<float>(scale);
                depths.depth[i] = z - kSigmas * sigma;
            }
        }
        if (backgroundIsFree) {
            openBackground(d, row, static_cast<float>(sensor.farLimit), depths.depth);
        }
    }
    views_.push_back(std::move(depths));
}

bool SeenThrough::at(const Eigen::Vector3d& place) const {
    // The newest view is the likeliest to know.
    return std::any_of(views_.rbegin(), views_.rend(), [&](const Depths& v) {
        const Eigen::Vector3d p = v.camera_T_world * place;
        if (p.z() < 0.05) {
            return false;
        }
        const Eigen::Vector2d uv = v.camera.project(p);
        const auto column = static_cast<int>(std::lround(uv.x()));
        const auto row = static_cast<int>(std::lround(uv.y()));
        return column >= 0 && row >= 0 && column < v.camera.width && row < v.camera.height &&
               p.z() < static_cast<double>(v.depth[static_cast<std::size_t>(row) *
                                                       static_cast<std::size_t>(v.camera.width) +
                                                   static_cast<std::size_t>(column)]);
    });
}

std::optional<Gap> gapBeside(const PixelGraph& graph, const SeenThrough& seen,
                             const Eigen::Vector3d& rim, const Eigen::Vector3d& normal,
                             const Eigen::Vector3d& outward, double resolution) {
    constexpr std::array<double, 3> kDistances = {1.5, 2.5, 4.0};  // [resolutions]
    constexpr int kSteps = 12;
    constexpr double kStep = kPi / 12;
    std::optional<Gap> gap;
    for (const double distance : kDistances) {
        // Straight on lies surface of the map, though it may be its other side.
        if (graph.nearest((rim + distance * resolution * outward).cast<float>(),
                          static_cast<float>(resolution))) {
            break;
        }
        bool free = false, unknown = false;
        std::optional<Eigen::Vector3d> dark;
        for (int i = 0; i <= kSteps && !unknown; ++i) {
            const double angle = 5 * kStep - i * kStep;
            const Eigen::Vector3d place =
                rim +
                distance * resolution * (std::cos(angle) * outward + std::sin(angle) * normal);
            if (seen.at(place)) {
                free = true;
            } else if (graph.nearest(place.cast<float>(), static_cast<float>(resolution))) {
                if (free) {
                    break;
                }
            } else if (free) {
                unknown = true;
                dark = place;
            } else if (!dark && i >= 5) {
                dark = place;
            }
        }
        unknown = unknown || (!free && dark);
        if (unknown) {
            if (!gap) {
                gap = Gap{0, *dark};
            }
            gap->width = (distance - 1) * resolution;
        }
        if (!unknown) {
            break;
        }
    }
    return gap;
}

}  // namespace riftmap
