// SPDX-License-Identifier: BSD-3-Clause
#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <unordered_map>

#include "baseline_tools.h"

namespace riftmap {

namespace {

constexpr int kCandidates = 150;
constexpr std::size_t kMostFrontiers = 600;  ///< looked at from a candidate
constexpr int kDirections = 24;              ///< tried at a candidate

constexpr double kSteepest = 0.3;  ///< cosine between a line of sight and the way into the unknown
/// Where surface ends there is more of it behind; the shadows in the air are many and mostly empty.
constexpr double kAir = 0.1;
constexpr int kMostTries = 2;  ///< views after which a frontier voxel that stays is given up

struct Frontier {
    Eigen::Vector3d centre;
    Eigen::Vector3d inward;  ///< unit, towards what is unknown
    double worth;            ///< 1 beside surface, less in the air
    std::size_t voxel;
};

enum Voxel : std::uint8_t { kUnknown, kFree, kOccupied };

/// The OctoMap as a plain array over the region of interest: quick to look into.
class VoxelGrid {
 public:
    /// `outside`: what lies around the region.
    VoxelGrid(const octomap::OcTree& tree, const Eigen::AlignedBox3d& region, Voxel outside)
        : outside_(outside),
          resolution_(tree.getResolution()),
          min_((region.min() / resolution_).array().floor() * resolution_),
          size_((region.sizes() / resolution_).array().ceil().cast<int>() + 1) {
        voxels_.reserve(static_cast<std::size_t>(size_.prod()));
        for (int z = 0; z < size_.z(); ++z) {
            for (int y = 0; y < size_.y(); ++y) {
                for (int x = 0; x < size_.x(); ++x) {
                    const Eigen::Vector3d c = centre({x, y, z});
                    const octomap::OcTreeNode* node = tree.search(c.x(), c.y(), c.z());
                    voxels_.push_back(node == nullptr              ? kUnknown
                                      : tree.isNodeOccupied(*node) ? kOccupied
                                                                   : kFree);
                }
            }
        }
    }

    Eigen::Vector3d centre(const Eigen::Vector3i& v) const {
        return min_ + resolution_ * (v.cast<double>().array() + 0.5).matrix();
    }
    bool inside(const Eigen::Vector3i& v) const {
        return (v.array() >= 0).all() && (v.array() < size_.array()).all();
    }
    Voxel at(const Eigen::Vector3i& v) const {
        return inside(v) ? static_cast<Voxel>(voxels_[flat(v)]) : outside_;
    }
    Voxel at(const Eigen::Vector3d& p) const { return at(voxelOf(p)); }

    /// Unknown voxels with a free neighbour.
    std::vector<Frontier> frontiers() const {
        std::vector<Frontier> out;
        for (int z = 0; z < size_.z(); ++z) {
            for (int y = 0; y < size_.y(); ++y) {
                for (int x = 0; x < size_.x(); ++x) {
                    const Eigen::Vector3i v(x, y, z);
                    if (at(v) != kUnknown) {
                        continue;
                    }
                    const Eigen::Vector3d inward = awayFromFree(v);
                    if (inward.squaredNorm() > 0) {
                        out.push_back({centre(v), inward.normalized(),
                                       besideSurface(v) ? 1.0 : kAir, flat(v)});
                    }
                }
            }
        }
        return out;
    }

    /// True if one looks from there into the unknown that begins with the frontier, through space
    /// that is free (half-voxel steps; beside the frontier the unknown may be grazed).
    bool sees(const Eigen::Vector3d& from, const Frontier& to) const {
        const Eigen::Vector3d way = to.centre - from;
        const double range = way.norm();
        if (way.dot(to.inward) < kSteepest * range) {
            return false;
        }
        const int steps = static_cast<int>(std::ceil(range / (0.5 * resolution_)));
        for (int i = 1; i < steps; ++i) {
            const Voxel here = at(voxelOf(from + way * (static_cast<double>(i) / steps)));
            if (here == kOccupied || (here == kUnknown && i + 3 < steps)) {
                return false;
            }
        }
        return true;
    }

 private:
    std::size_t flat(const Eigen::Vector3i& v) const {
        const Eigen::Matrix<std::size_t, 3, 1> at = v.cast<std::size_t>();
        const Eigen::Matrix<std::size_t, 3, 1> size = size_.cast<std::size_t>();
        return (at.z() * size.y() + at.y()) * size.x() + at.x();
    }
    Eigen::Vector3i voxelOf(const Eigen::Vector3d& p) const {
        return ((p - min_) / resolution_).array().floor().cast<int>();
    }
    /// Sum of the directions away from free neighbours.
    Eigen::Vector3d awayFromFree(const Eigen::Vector3i& v) const {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int axis = 0; axis < 3; ++axis) {
            for (const int d : {-1, 1}) {
                Eigen::Vector3i n = v;
                n[axis] += d;
                sum[axis] -= at(n) == kFree ? d : 0;
            }
        }
        return sum;
    }
    bool besideSurface(const Eigen::Vector3i& v) const {
        for (int i = 0; i < 27; ++i) {
            const Eigen::Vector3i n = v + Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
            if (at(n) == kOccupied) {
                return true;
            }
        }
        return false;
    }

    Voxel outside_;
    double resolution_;
    Eigen::Vector3d min_;
    Eigen::Vector3i size_;
    std::vector<std::uint8_t> voxels_;
};

class OctomapFrontier : public ViewSource {
 public:
    OctomapFrontier(const BaselineOptions& options, const Eigen::AlignedBox3d& target,
                    std::uint64_t seed)
        : options_(options), target_(target), random_(seed), tree_(resolutionOf(options, target)) {}

    std::optional<std::vector<Pose>> next(const BaselineState& state) override {
        insert(state);
        const Eigen::AlignedBox3d region = target_.isEmpty() ? workspace(state.limits) : target_;
        // Round an object that stands alone there is nothing.
        const VoxelGrid grid(tree_, region, target_.isEmpty() ? kUnknown : kFree);
        std::vector<Frontier> all = grid.frontiers();
        std::erase_if(all, [&](const Frontier& f) {
            const auto tries = tries_.find(f.voxel);
            return tries != tries_.end() && tries->second >= kMostTries;
        });
        if (all.empty()) {
            return std::nullopt;
        }
        std::shuffle(all.begin(), all.end(), random_);
        const std::vector<Frontier> some(
            all.begin(),
            all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size(), kMostFrontiers)));
        std::vector<Candidate> candidates;
        for (int i = 0; i < kCandidates; ++i) {
            if (auto c = candidate(state, grid, some)) {
                c->gain *= static_cast<double>(all.size()) / static_cast<double>(some.size());
                candidates.push_back(*c);
            }
        }
        auto path = best(state, candidates);
        if (path) {
            for (const Frontier& f : all) {
                if (inView(state, path->back(), f.centre) &&
                    grid.sees(path->back().translation, f)) {
                    ++tries_[f.voxel];
                }
            }
        }
        return path;
    }

 private:
    struct Candidate {
        Pose view;
        double gain = 0;  ///< worth of the frontier voxels in view
        double rate = 0;  ///< of them a second, going straight
    };

    static double resolutionOf(const BaselineOptions& options, const Eigen::AlignedBox3d& target) {
        if (options.resolution > 0) {
            return options.resolution;
        }
        return target.isEmpty() ? 0.1 : target.sizes().maxCoeff() / 25;
    }

    void insert(const BaselineState& state) {
        octomap::Pointcloud cloud;
        cloud.reserve(state.cloud.size());
        for (const Eigen::Vector3f& p : state.cloud) {
            cloud.push_back(p.x(), p.y(), p.z());
        }
        const Eigen::Vector3f o = state.pose.translation.cast<float>();
        tree_.insertPointCloud(cloud, octomap::point3d(o.x(), o.y(), o.z()), -1.0, false, true);
    }

    /// A random place, and of the directions towards frontiers seen from there the best one.
    std::optional<Candidate> candidate(const BaselineState& state, const VoxelGrid& grid,
                                       const std::vector<Frontier>& frontiers) {
        const Eigen::Vector3d place = randomIn(workspace(state.limits), random_);
        if ((target_.isEmpty() && grid.at(place) != kFree) || !state.segmentClear(place, place)) {
            return std::nullopt;
        }
        std::vector<const Frontier*> seen;
        for (const Frontier& f : frontiers) {
            const double range = (f.centre - place).norm();
            if (range >= state.limits.nearLimit && range <= state.limits.farLimit &&
                grid.sees(place, f)) {
                seen.push_back(&f);
            }
        }
        Candidate out;
        for (int i = 0; i < kDirections && !seen.empty(); ++i) {
            const Eigen::Vector3d& f = seen[random_() % seen.size()]->centre;
            const Pose view = viewOf(state.limits, place, f - place);
            double gain = 0;
            for (const Frontier* p : seen) {
                gain += inView(state, view, p->centre) ? p->worth : 0.0;
            }
            if (gain > out.gain) {
                out.view = view;
                out.gain = gain;
            }
        }
        if (out.gain <= 0) {
            return std::nullopt;
        }
        out.rate = out.gain / (1 + (place - state.pose.translation).norm());
        return out;
    }

    std::optional<std::vector<Pose>> best(const BaselineState& state,
                                          std::vector<Candidate>& candidates) const {
        std::stable_sort(candidates.begin(), candidates.end(),
                         [](const Candidate& a, const Candidate& b) { return a.rate > b.rate; });
        // An image that is full of frontier 2 m away.
        const double full = 4.0 * state.camera.width * state.camera.height /
                            (state.camera.fx * state.camera.fy) /
                            (tree_.getResolution() * tree_.getResolution());
        for (const Candidate& c : candidates) {
            if (c.gain < options_.minGain * full) {
                continue;
            }
            if (auto path = pathTo(state, c.view, 20000)) {
                return path;
            }
        }
        return std::nullopt;
    }

    BaselineOptions options_;
    Eigen::AlignedBox3d target_;
    std::mt19937_64 random_;
    octomap::OcTree tree_;
    std::unordered_map<std::size_t, int> tries_;  ///< by voxel; looked up only
};

}  // namespace

std::unique_ptr<ViewSource> makeOctomapFrontier(const BaselineOptions& options,
                                                const Eigen::AlignedBox3d& target,
                                                std::uint64_t seed) {
    return std::make_unique<OctomapFrontier>(options, target, seed);
}

}  // namespace riftmap
