// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace riftmap {

/// Neighbours within a radius in a fixed set of points, by a dense grid of cells. Built in
/// O(points + cells), without a tree: a million points take tens of milliseconds, so that a map
/// can be judged anew after every view. Reading is thread-safe.
class PointIndex {
 public:
    struct Neighbour {
        std::uint32_t index = 0;    ///< into the points given
        float squaredDistance = 0;  ///< [m^2]
    };

    PointIndex() = default;
    /// `cell`: edge of a cell [m], best near the radius of the queries; it grows where the box
    /// would take more than 2^25 cells. Points that are not finite, or outside `bounds`, are left
    /// out: a single far outlier must not blow up the grid.
    PointIndex(std::span<const Eigen::Vector3f> points, float cell,
               const Eigen::AlignedBox3f& bounds);
    /// The same within the box of all finite points.
    PointIndex(std::span<const Eigen::Vector3f> points, float cell);

    std::size_t size() const { return order_.size(); }

    /// The nearest point within the radius [m]; of equally near ones the first.
    std::optional<Neighbour> nearest(const Eigen::Vector3f& query, float radius) const;

    /// Calls f(index, squared distance) for every point within the radius until f returns true.
    /// Returns whether one did.
    template <class F>
    bool anyWithin(const Eigen::Vector3f& query, float radius, F&& f) const {
        const float limit = radius * radius;
        return visitCells(query, radius, [&](std::uint32_t begin, std::uint32_t end) {
            for (std::uint32_t i = begin; i < end; ++i) {
                const float d2 = (points_[i] - query).squaredNorm();
                if (d2 <= limit && f(order_[i], d2)) {
                    return true;
                }
            }
            return false;
        });
    }

 private:
    int cellOf(float x, int axis) const;
    std::size_t flat(int x, int y, int z) const {
        return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size_.y()) +
                static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(size_.x()) +
               static_cast<std::size_t>(x);
    }
    /// Calls f(begin, end) for each row of cells that the query's box touches.
    template <class F>
    bool visitCells(const Eigen::Vector3f& query, float radius, F&& f) const {
        if (order_.empty()) {
            return false;
        }
        int low[3];
        int high[3];
        for (int a = 0; a < 3; ++a) {
            if (query[a] + radius < min_[a] || query[a] - radius > max_[a]) {
                return false;
            }
            low[a] = cellOf(query[a] - radius, a);
            high[a] = cellOf(query[a] + radius, a);
        }
        for (int z = low[2]; z <= high[2]; ++z) {
            for (int y = low[1]; y <= high[1]; ++y) {
                const std::uint32_t begin = start_[flat(low[0], y, z)];
                const std::uint32_t end = start_[flat(high[0], y, z) + 1];
                if (begin < end && f(begin, end)) {
                    return true;
                }
            }
        }
        return false;
    }

    float cell_ = 1;
    Eigen::Vector3f min_ = Eigen::Vector3f::Zero(), max_ = Eigen::Vector3f::Zero();
    Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
    std::vector<std::uint32_t> start_;     ///< first point of each cell, and the end
    std::vector<std::uint32_t> order_;     ///< index of each stored point
    std::vector<Eigen::Vector3f> points_;  ///< in the order of the cells
};

}  // namespace riftmap
