// SPDX-License-Identifier: BSD-3-Clause
// What the pixels of a view show that have no match.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "riftmap/core/parallel.h"
#include "riftmap/planner/free_space.h"

namespace riftmap {

namespace {

/// Greatest disparity of surface that a pixel of this row may show while the right camera does not
/// see it, for what is matched to the right of it stands before it there [px]; minus infinity:
/// there is none. Surface with a greater one both cameras see.
std::vector<float> hiddenFromTheRight(const DisparityImage& d, int row) {
    std::vector<float> hidden(static_cast<std::size_t>(d.width));
    float before = -std::numeric_limits<float>::infinity();
    for (int column = d.width - 1; column >= d.firstColumn; --column) {
        before -= 1;
        hidden[static_cast<std::size_t>(column)] = before;
        if (d.valid(column, row)) {
            before = std::max(before, d.at(column, row));
        }
    }
    return hidden;
}

/// A row's pixels without a match before which nothing is, by their neighbours: the strip beside a
/// step that one camera alone sees is as wide as the step in disparity, and a surface that is too
/// near has the greatest disparities beside it.
void openBackground(const View& view, const SensorModel& sensor, int row,
                    std::vector<float>& depth) {
    constexpr float kWindow = 8;     // [px] that matching may add to such a strip
    constexpr float kAlmost = 0.9F;  // of the greatest disparity
    const DisparityImage& d = view.disparity;
    const auto farLimit = static_cast<float>(sensor.farLimit);
    const std::vector<float> hidden = hiddenFromTheRight(d, row);
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
        const bool oneSided = !sensor.exactDepth() && hole &&
                              static_cast<float>(end - begin) <= std::abs(right - left) + kWindow;
        for (int column = begin; column < end && !tooNear && !oneSided; ++column) {
            const auto behind = static_cast<double>(hidden[static_cast<std::size_t>(column)]);
            // Beyond all depths, or nothing there: `depth` is that of a disparity above its offset.
            const bool all = sensor.exactDepth() || behind + view.camera.doffs <= 0;
            depth[d.index(column, row)] =
                all ? farLimit : std::min(farLimit, static_cast<float>(view.camera.depth(behind)));
        }
        begin = end;
    }
}

}  // namespace

bool FreeSpace::nothingTooNear(const View& view, const SensorModel& sensor, int column,
                               int row) const {
    const StereoCamera& c = view.camera;
    const Eigen::Vector3d ray((column - c.cx) / c.fx, (row - c.cy) / c.fy, 1.0);
    const double length = ray.norm();
    const Eigen::Vector3d step = view.world_T_camera.rotation * ray / length;
    const double end = sensor.nearLimit * length;
    const double stride = 0.25 * voxel_;
    for (double s = sensor.clearance; s < end + stride; s += stride) {
        const Eigen::Vector3i v =
            voxelOf(view.world_T_camera.translation + std::min(s, end) * step);
        if (!inside(v) || (voxels_[index(v)] & (kProvenBit | kSurfaceBit)) != kProvenBit) {
            return false;
        }
    }
    return true;
}

/// The same for all pixels of a rectangle at once, both corners included: true if all voxels are
/// proven free that may lie before them up to the near limit; false says nothing.
bool FreeSpace::nothingTooNear(const View& view, const SensorModel& sensor,
                               const Eigen::Vector2i& first, const Eigen::Vector2i& last) const {
    const StereoCamera& c = view.camera;
    Eigen::AlignedBox3d box;
    for (const int column : {first.x(), last.x()}) {
        for (const int row : {first.y(), last.y()}) {
            const Eigen::Vector3d ray((column - c.cx) / c.fx, (row - c.cy) / c.fy, 1.0);
            box.extend(view.world_T_camera * Eigen::Vector3d(sensor.nearLimit * ray));
        }
    }
    box.extend(view.world_T_camera.translation);
    const Eigen::Vector3i low = voxelOf(box.min());
    const Eigen::Vector3i high = voxelOf(box.max());
    if (!inside(low) || !inside(high)) {
        return false;
    }
    for (int z = low.z(); z <= high.z(); ++z) {
        for (int y = low.y(); y <= high.y(); ++y) {
            for (int x = low.x(); x <= high.x(); ++x) {
                if ((voxels_[index({x, y, z})] & (kProvenBit | kSurfaceBit)) != kProvenBit) {
                    return false;
                }
            }
        }
    }
    return true;
}

EmptyPixels FreeSpace::emptyPixels(const View& view, const SensorModel& sensor,
                                   bool backgroundIsFree) const {
    const DisparityImage& d = view.disparity;
    EmptyPixels empty{std::vector<float>(d.disparity.size(), 0.0F),
                      std::vector<std::uint8_t>(d.disparity.size(), 0)};
    if (backgroundIsFree) {
        parallelForEach(d.height, 8,
                        [&](int row) { openBackground(view, sensor, row, empty.depth); });
    }
    if (!sensor.exactDepth()) {
        return empty;
    }
    constexpr int kTile = 32;  // [px]
    parallelForEach((d.height + kTile - 1) / kTile, 1, [&](int strip) {
        const int top = strip * kTile;
        const int bottom = std::min(top + kTile, d.height) - 1;
        for (int left = d.firstColumn; left < d.width; left += kTile) {
            const int right = std::min(left + kTile, d.width) - 1;
            const bool all = nothingTooNear(view, sensor, {left, top}, {right, bottom});
            for (int row = top; row <= bottom; ++row) {
                for (int column = left; column <= right; ++column) {
                    if (!d.valid(column, row) &&
                        (all || nothingTooNear(view, sensor, column, row))) {
                        empty.proven[d.index(column, row)] = 1;
                        empty.depth[d.index(column, row)] = static_cast<float>(sensor.farLimit);
                    }
                }
            }
        }
    });
    return empty;
}

}  // namespace riftmap
