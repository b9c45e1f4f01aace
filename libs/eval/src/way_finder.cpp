// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <tuple>

#include "riftmap/eval/baselines.h"

namespace riftmap {

namespace {

using Cell = std::array<int, 3>;

/// A* over a lattice whose node (0, 0, 0) is `a`; edges are checked as they are met.
class LatticeSearch {
 public:
    LatticeSearch(const BaselineState& state, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                  double step)
        : state_(state), a_(a), b_(b), step_(step) {}

    std::optional<std::vector<Eigen::Vector3d>> run(std::size_t maxNodes) {
        push({0, 0, 0}, {0, 0, 0}, 0);
        for (std::size_t n = 0; n < maxNodes && !open_.empty(); ++n) {
            const auto [estimate, order, cell, from, cost] = open_.top();
            open_.pop();
            if (!from_.emplace(cell, from).second) {
                continue;
            }
            const Eigen::Vector3d here = place(cell);
            if ((here - b_).norm() <= 1.75 * step_ && state_.segmentClear(here, b_)) {
                return trace(cell);
            }
            expand(cell, cost);
        }
        return std::nullopt;
    }

 private:
    Eigen::Vector3d place(const Cell& c) const {
        return a_ + step_ * Eigen::Vector3d(c[0], c[1], c[2]);
    }
    void push(const Cell& cell, const Cell& from, double cost) {
        open_.emplace(cost + (place(cell) - b_).norm(), count_++, cell, from, cost);
    }
    void expand(const Cell& cell, double cost) {
        for (int axis = 0; axis < 3; ++axis) {
            for (const int d : {-1, 1}) {
                Cell next = cell;
                next[static_cast<std::size_t>(axis)] += d;
                const Eigen::Vector3d p = place(next);
                if (from_.count(next) == 0 && (p.array() >= state_.limits.boxMin.array()).all() &&
                    (p.array() <= state_.limits.boxMax.array()).all() &&
                    state_.segmentClear(place(cell), p)) {
                    push(next, cell, cost + step_);
                }
            }
        }
    }
    std::vector<Eigen::Vector3d> trace(Cell cell) const {
        std::vector<Eigen::Vector3d> way{b_};
        while (cell != Cell{0, 0, 0}) {
            way.push_back(place(cell));
            cell = from_.at(cell);
        }
        std::reverse(way.begin(), way.end());
        return way;
    }

    const BaselineState& state_;
    Eigen::Vector3d a_, b_;
    double step_;
    std::map<Cell, Cell> from_;
    using Entry = std::tuple<double, std::size_t, Cell, Cell, double>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
    std::size_t count_ = 0;  ///< equal estimates: first come, first served
};

/// Leaves out every place that can be cut straight past.
std::vector<Eigen::Vector3d> shortened(const BaselineState& state, const Eigen::Vector3d& a,
                                       const std::vector<Eigen::Vector3d>& way) {
    std::vector<Eigen::Vector3d> out;
    Eigen::Vector3d here = a;
    for (std::size_t i = 0; i < way.size();) {
        std::size_t far = way.size() - 1;
        while (far > i && !state.segmentClear(here, way[far])) {
            --far;
        }
        here = way[far];
        out.push_back(here);
        i = far + 1;
    }
    return out;
}

}  // namespace

std::optional<std::vector<Eigen::Vector3d>> findWay(const BaselineState& state,
                                                    const Eigen::Vector3d& a,
                                                    const Eigen::Vector3d& b, double step,
                                                    std::size_t maxNodes) {
    if (state.segmentClear(a, b)) {
        return std::vector<Eigen::Vector3d>{b};
    }
    const auto way = LatticeSearch(state, a, b, step).run(maxNodes);
    if (!way) {
        return std::nullopt;
    }
    return shortened(state, a, *way);
}

}  // namespace riftmap
