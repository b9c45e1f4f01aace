// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/point_index.h"

#include <algorithm>
#include <cmath>

namespace riftmap {

namespace {

constexpr double kMaxCells = 1 << 25;
constexpr std::uint32_t kOutside = 0xFFFFFFFFU;

Eigen::AlignedBox3f boxOf(std::span<const Eigen::Vector3f> points) {
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& p : points) {
        if (p.allFinite()) {
            box.extend(p);
        }
    }
    return box;
}

}  // namespace

PointIndex::PointIndex(std::span<const Eigen::Vector3f> points, float cell)
    : PointIndex(points, cell, boxOf(points)) {}

PointIndex::PointIndex(std::span<const Eigen::Vector3f> points, float cell,
                       const Eigen::AlignedBox3f& bounds)
    : cell_(cell) {
    const Eigen::AlignedBox3f box = bounds.intersection(boxOf(points));
    if (points.empty() || box.isEmpty()) {
        return;
    }
    min_ = box.min();
    max_ = box.max();
    for (;; cell_ *= 1.25F) {
        const Eigen::Vector3f cells = (max_ - min_) / cell_;
        if (cells.maxCoeff() < 1e6F &&
            (cells.cast<double>().array().floor() + 1).prod() <= kMaxCells) {
            size_ = cells.array().floor().matrix().cast<int>() + Eigen::Vector3i::Ones();
            break;
        }
    }
    start_.assign(static_cast<std::size_t>(size_.x()) * static_cast<std::size_t>(size_.y()) *
                          static_cast<std::size_t>(size_.z()) +
                      1,
                  0);
    std::vector<std::uint32_t> cells(points.size(), kOutside);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Eigen::Vector3f& p = points[i];
        if (p.allFinite() && box.contains(p)) {
            cells[i] = static_cast<std::uint32_t>(
                flat(cellOf(p.x(), 0), cellOf(p.y(), 1), cellOf(p.z(), 2)));
            ++start_[cells[i]];
        }
    }
    std::uint32_t sum = 0;
    for (std::uint32_t& s : start_) {
        sum += s;
        s = sum;  // the end of its cell; filling from behind turns it into the start
    }
    order_.resize(sum);
    points_.resize(sum);
    for (std::size_t i = points.size(); i-- > 0;) {
        if (cells[i] != kOutside) {
            const std::uint32_t at = --start_[cells[i]];
            order_[at] = static_cast<std::uint32_t>(i);
            points_[at] = points[i];
        }
    }
}

int PointIndex::cellOf(float x, int axis) const {
    const float c = std::floor((x - min_[axis]) / cell_);
    return static_cast<int>(std::clamp(c, 0.0F, static_cast<float>(size_[axis] - 1)));
}

std::optional<PointIndex::Neighbour> PointIndex::nearest(const Eigen::Vector3f& query,
                                                         float radius) const {
    Neighbour best{kOutside, radius * radius};
    const auto look = [&](const Eigen::Vector3f&, float reach) {
        anyWithin(query, reach, [&](std::uint32_t i, float d2) {
            if (d2 < best.squaredDistance || (d2 == best.squaredDistance && i < best.index)) {
                best = {i, d2};
            }
            return false;
        });
    };
    // Most queries end near: a small look first, and the full radius only where that found none.
    float reach = std::min(radius, cell_ / 8);
    for (;;) {
        look(query, reach);
        if (best.index != kOutside || reach >= radius) {
            break;
        }
        reach = std::min(radius, reach * 4);
    }
    if (best.index == kOutside) {
        return std::nullopt;
    }
    return best;
}

}  // namespace riftmap
