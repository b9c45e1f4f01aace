// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/coverage_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "riftmap/core/parallel.h"

namespace riftmap {

namespace {

constexpr double kMostCells = 1 << 25;
constexpr std::uint32_t kNobody = ~0U;
constexpr std::uint8_t kChanged = 1;  ///< holds a changed vertex
constexpr std::uint8_t kLook = 2;     ///< its samples may have changed
constexpr std::uint8_t kNeeded = 4;   ///< its vertices are what those samples may see

double share(std::size_t part, std::size_t whole) {
    return whole == 0 ? std::numeric_limits<double>::quiet_NaN()
                      : static_cast<double>(part) / static_cast<double>(whole);
}

bool same(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
    return a == b || (!a.allFinite() && !b.allFinite());
}

}  // namespace

CoverageTracker::CoverageTracker(const CoverageJudge& judge) : judge_(judge) {
    for (const double delta : judge.deltas()) {
        limits_.push_back(coverageLimit(delta));
    }
    // Wider than the largest delta by more than rounding: what is that near lies in this cell or
    // one of the 26 around.
    cell_ = 1.001 * static_cast<double>(limits_.back());
    const auto& samples = judge.samples().points;
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3f& p : samples) {
        box.extend(p.cast<double>());
    }
    for (;; cell_ *= 1.25) {
        const Eigen::Array3d cells = (box.sizes().array() / cell_).floor() + 5;
        if (cells.prod() <= kMostCells) {
            size_ = cells.cast<int>();
            break;
        }
    }
    min_ = box.min() - Eigen::Vector3d::Constant(2 * cell_);
    flags_.assign(static_cast<std::size_t>(size_.cast<double>().prod()), 0);
    start_.assign(flags_.size() + 1, 0);
    for (const Eigen::Vector3f& p : samples) {
        ++start_[cellOf(p) + 1];
    }
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    order_.resize(samples.size());
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    for (std::uint32_t i = 0; i < samples.size(); ++i) {
        order_[next[cellOf(samples[i])]++] = i;
    }
    witness_.assign(samples.size(), kNobody);
    level_.assign(samples.size(), static_cast<std::uint8_t>(limits_.size()));
    all_.assign(limits_.size() + 1, 0);
    seen_.assign(limits_.size() + 1, 0);
    all_.back() = samples.size();
    seen_.back() = judge.observable().count;
}

/// The cell of a point, or the number of cells for one that is too far away to cover anything.
std::size_t CoverageTracker::cellOf(const Eigen::Vector3f& point) const {
    const Eigen::Array3d at = (point.cast<double>() - min_).array() / cell_;
    if (!((at >= 1).all() && (at < size_.cast<double>() - 1).all())) {
        return flags_.size();
    }
    const Eigen::Array3i i = at.cast<int>();
    return (static_cast<std::size_t>(i.z()) * static_cast<std::size_t>(size_.y()) +
            static_cast<std::size_t>(i.y())) *
               static_cast<std::size_t>(size_.x()) +
           static_cast<std::size_t>(i.x());
}

void CoverageTracker::mark(const Eigen::Vector3f& point) {
    const std::size_t cell = cellOf(point);
    if (cell < flags_.size() && (flags_[cell] & kChanged) == 0) {
        flags_[cell] |= kChanged;
        changed_.push_back(static_cast<Cell>(cell));
    }
}

/// Flags these cells and the 26 around each; returns those flagged, each once.
std::vector<CoverageTracker::Cell> CoverageTracker::spread(const std::vector<Cell>& cells,
                                                           std::uint8_t bit) {
    std::vector<Cell> out;
    const auto row = static_cast<std::ptrdiff_t>(size_.x());
    const std::ptrdiff_t layer = row * size_.y();
    for (const Cell cell : cells) {
        for (int i = 0; i < 27; ++i) {
            const auto at = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(cell) + i % 3 - 1 +
                                                     (i / 3 % 3 - 1) * row + (i / 9 - 1) * layer);
            if (at < flags_.size() && (flags_[at] & bit) == 0) {
                flags_[at] |= bit;
                out.push_back(static_cast<Cell>(at));
            }
        }
    }
    return out;
}

/// The sample's level now; changes only what is this sample's.
std::uint8_t CoverageTracker::look(std::size_t sample, std::span<const Eigen::Vector3f> vertices,
                                   const PointIndex& index, const std::vector<std::uint32_t>& ids) {
    const Eigen::Vector3f& p = judge_.samples().points[sample];
    std::uint32_t& witness = witness_[sample];
    if (witness < vertices.size() &&
        std::sqrt((vertices[witness] - p).squaredNorm()) <= limits_.front()) {
        return 0;
    }
    const auto near = index.nearest(p, limits_.back());
    witness = near ? ids[near->index] : kNobody;
    if (!near) {
        return static_cast<std::uint8_t>(limits_.size());
    }
    const float distance = std::sqrt(near->squaredDistance);
    return static_cast<std::uint8_t>(std::lower_bound(limits_.begin(), limits_.end(), distance) -
                                     limits_.begin());
}

std::vector<Coverage> CoverageTracker::update(std::span<const Eigen::Vector3f> vertices) {
    const Eigen::Vector3f nowhere =
        Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
    changed_.clear();
    for (std::size_t i = 0; i < std::max(vertices.size(), before_.size()); ++i) {
        const Eigen::Vector3f& old = i < before_.size() ? before_[i] : nowhere;
        const Eigen::Vector3f& now = i < vertices.size() ? vertices[i] : nowhere;
        if (!same(old, now)) {
            mark(old);
            mark(now);
        }
    }
    before_.assign(vertices.begin(), vertices.end());
    const std::vector<Cell> places = spread(changed_, kLook);
    const std::vector<Cell> around = spread(places, kNeeded);
    std::vector<std::uint32_t> ids;
    std::vector<Eigen::Vector3f> points;
    for (std::uint32_t i = 0; i < vertices.size(); ++i) {
        const std::size_t cell = cellOf(vertices[i]);
        if (cell < flags_.size() && (flags_[cell] & kNeeded) != 0) {
            ids.push_back(i);
            points.push_back(vertices[i]);
        }
    }
    const PointIndex index(points, limits_.back() / 2);
    std::vector<std::uint8_t> levels(level_);
    parallelForEach(places.size(), 64, [&](std::size_t k) {
        for (std::uint32_t i = start_[places[k]]; i < start_[places[k] + 1]; ++i) {
            levels[order_[i]] = look(order_[i], vertices, index, ids);
        }
    });
    for (const Cell place : places) {
        for (std::uint32_t i = start_[place]; i < start_[place + 1]; ++i) {
            const std::uint32_t sample = order_[i];
            const std::size_t observable = judge_.observable().observable[sample];
            --all_[level_[sample]];
            ++all_[levels[sample]];
            seen_[level_[sample]] -= observable;
            seen_[levels[sample]] += observable;
        }
    }
    level_.swap(levels);
    for (const Cell cell : around) {  // holds the others, too
        flags_[cell] = 0;
    }
    return figures();
}

std::vector<Coverage> CoverageTracker::figures() const {
    std::vector<Coverage> out;
    std::size_t all = 0;
    std::size_t seen = 0;
    for (std::size_t k = 0; k < limits_.size(); ++k) {
        all += all_[k];
        seen += seen_[k];
        out.push_back({judge_.deltas()[k], share(seen, judge_.observable().count),
                       share(all, judge_.samples().points.size())});
    }
    return out;
}

}  // namespace riftmap
