// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "riftmap/core/parallel.h"
#include "riftmap/eval/observable.h"

namespace riftmap {

namespace {

constexpr double kMostNodes = 1 << 24;

std::string text(const Eigen::Vector3d& p) {
    std::ostringstream out;
    out << '(' << p.x() << ' ' << p.y() << ' ' << p.z() << ')';
    return out.str();
}

void checkStart(const RayCaster& caster, const ViewSpace& space) {
    const bool inside = (space.start.array() >= space.boxMin.array()).all() &&
                        (space.start.array() <= space.boxMax.array()).all();
    if (!inside) {
        throw std::runtime_error("the start " + text(space.start) +
                                 " lies outside the workspace box " + text(space.boxMin) + " .. " +
                                 text(space.boxMax));
    }
    if (const auto wall = caster.closest(space.start, space.clearance)) {
        throw std::runtime_error("the start " + text(space.start) + " is " +
                                 std::to_string(wall->distance) +
                                 " m from a surface, nearer than the clearance of " +
                                 std::to_string(space.clearance) + " m");
    }
}

}  // namespace

ReachableSpace::ReachableSpace(const RayCaster& caster, const ViewSpace& space, double grid)
    : caster_(&caster), space_(space), grid_(grid) {
    checkStart(caster, space);
    if (grid_ <= 0) {
        grid_ = std::clamp(space.clearance / 2, 0.02, 0.1);
    }
    const auto steps = [&] {
        const Eigen::Vector3d sides = space_.boxMax - space_.boxMin;
        return Eigen::Vector3d((sides.array() / grid_ + 1e-9).floor());
    };
    while ((steps().array() + 1).prod() > kMostNodes) {
        grid_ *= 1.1;
    }
    size_ = steps().cast<int>() + Eigen::Vector3i::Ones();
    // What is left over lies at both ends alike.
    origin_ = (space_.boxMin + space_.boxMax - grid_ * steps()) / 2;
    const auto count = static_cast<std::size_t>(size_.x()) * static_cast<std::size_t>(size_.y()) *
                       static_cast<std::size_t>(size_.z());
    distance_.resize(count);
    const double cap = space_.clearance + 2 * grid_;
    parallelForEach(count, 64, [&](std::size_t i) {
        const auto wall = caster_->closest(position(i), cap);
        distance_[i] = static_cast<float>(wall ? wall->distance : cap);
    });
    reachable_.assign(count, 0);
    std::vector<std::size_t> first;
    anyNodeAround(space_.start, [&](std::size_t node) {
        if (caster_->sweptClear(space_.start, position(node), space_.clearance)) {
            first.push_back(node);
        }
        return false;
    });
    if (first.empty()) {
        throw std::runtime_error("from the start " + text(space_.start) +
                                 " no camera position of the grid of " + std::to_string(grid_) +
                                 " m can be reached; a smaller Eval.grid may help");
    }
    flood(first);
    markNeighbours();
}

Eigen::Vector3d ReachableSpace::position(std::size_t node) const {
    const auto nx = static_cast<std::size_t>(size_.x());
    const auto ny = static_cast<std::size_t>(size_.y());
    const Eigen::Matrix<std::size_t, 3, 1> at(node % nx, node / nx % ny, node / nx / ny);
    return origin_ + grid_ * at.cast<double>();
}

std::ptrdiff_t ReachableSpace::nearestNode(const Eigen::Vector3d& place) const {
    const Eigen::Vector3d steps = ((place - origin_) / grid_).array().round();
    if ((steps.array() < 0).any() || (steps.array() >= size_.cast<double>().array()).any()) {
        return -1;
    }
    const Eigen::Matrix<std::ptrdiff_t, 3, 1> n = steps.cast<std::ptrdiff_t>();
    return (n.z() * size_.y() + n.y()) * size_.x() + n.x();
}

bool ReachableSpace::stepClear(std::size_t a, std::size_t b) const {
    const auto clearance = static_cast<float>(space_.clearance);
    if (distance_[a] < clearance || distance_[b] < clearance) {
        return false;
    }
    // The distance changes by at most a metre a metre: between the two it cannot fall below this.
    if ((distance_[a] + distance_[b] - static_cast<float>(grid_)) / 2 >= clearance) {
        return true;
    }
    return caster_->sweptClear(position(a), position(b), space_.clearance);
}

template <class F>
bool ReachableSpace::anyNodeAround(const Eigen::Vector3d& place, F&& f) const {
    for (int i = 0; i < 27; ++i) {
        const Eigen::Vector3i offset(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
        const std::ptrdiff_t node = nearestNode(place + grid_ * offset.cast<double>());
        if (node >= 0 && f(static_cast<std::size_t>(node))) {
            return true;
        }
    }
    return false;
}

void ReachableSpace::markNeighbours() {
    beside_ = reachable_;
    parallelForEach(beside_.size(), 64, [&](std::size_t i) {
        beside_[i] = anyNodeAround(position(i), [&](std::size_t n) { return reachable_[n] != 0; });
    });
}

void ReachableSpace::flood(std::vector<std::size_t> queue) {
    for (const std::size_t node : queue) {
        reachable_[node] = 1;
    }
    const std::ptrdiff_t stride[3] = {1, size_.x(),
                                      static_cast<std::ptrdiff_t>(size_.x()) * size_.y()};
    for (std::size_t head = 0; head < queue.size(); ++head) {
        const std::size_t node = queue[head];
        for (int axis = 0; axis < 3; ++axis) {
            const auto at = static_cast<std::ptrdiff_t>(node) / stride[axis] % size_[axis];
            for (const int step : {-1, 1}) {
                if (at + step < 0 || at + step >= size_[axis]) {
                    continue;
                }
                const auto next = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(node) +
                                                           step * stride[axis]);
                if (reachable_[next] == 0 && stepClear(node, next)) {
                    reachable_[next] = 1;
                    queue.push_back(next);
                }
            }
        }
    }
}

std::size_t ReachableSpace::reachableCount() const {
    return static_cast<std::size_t>(std::count(reachable_.begin(), reachable_.end(), 1));
}

ReachableSpace::Room ReachableSpace::room(const Eigen::Vector3d& place) const {
    const std::ptrdiff_t nearest = nearestNode(place);
    if (nearest < 0 || beside_[static_cast<std::size_t>(nearest)] == 0) {
        return {};
    }
    const auto node = static_cast<std::size_t>(nearest);
    // The distance changes by at most a metre a metre, so this bounds the whole way to the node.
    const double least = static_cast<double>(distance_[node]) - (place - position(node)).norm();
    return {reachable_[node] != 0 && least >= space_.clearance, distance_[node]};
}

bool ReachableSpace::contains(const Eigen::Vector3d& place) const {
    if ((place.array() < space_.boxMin.array()).any() ||
        (place.array() > space_.boxMax.array()).any() ||
        caster_->closest(place, space_.clearance)) {
        return false;
    }
    return anyNodeAround(place, [&](std::size_t node) {
        return reachable_[node] != 0 &&
               caster_->sweptClear(place, position(node), space_.clearance);
    });
}

}  // namespace riftmap
