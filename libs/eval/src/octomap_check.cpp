// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/octomap_check.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <tuple>

namespace riftmap {

namespace {

using Key = octomap::OcTreeKey;

bool keyLess(const Key& a, const Key& b) {
    return std::make_tuple(a[2], a[1], a[0]) < std::make_tuple(b[2], b[1], b[0]);
}

/// Voxels in order, each once.
class VoxelSet {
 public:
    VoxelSet(const octomap::OcTree& tree, std::span<const Eigen::Vector3f> points) {
        for (const Eigen::Vector3f& p : points) {
            Key key;
            if (p.allFinite() && tree.coordToKeyChecked(p.x(), p.y(), p.z(), key)) {
                keys_.push_back(key);
            }
        }
        std::sort(keys_.begin(), keys_.end(), keyLess);
        keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
    }
    bool contains(const Key& key) const {
        return std::binary_search(keys_.begin(), keys_.end(), key, keyLess);
    }
    const std::vector<Key>& keys() const { return keys_; }

 private:
    std::vector<Key> keys_;
};

/// Whether f holds for one of the 26 voxels around.
template <class F>
bool anyAround(const Key& key, F&& f) {
    for (int z = -1; z <= 1; ++z) {
        for (int y = -1; y <= 1; ++y) {
            for (int x = -1; x <= 1; ++x) {
                const Key other(static_cast<octomap::key_type>(key[0] + x),
                                static_cast<octomap::key_type>(key[1] + y),
                                static_cast<octomap::key_type>(key[2] + z));
                if (!(other == key) && f(other)) {
                    return true;
                }
            }
        }
    }
    return false;
}

double share(std::size_t part, std::size_t whole) {
    return whole == 0 ? std::numeric_limits<double>::quiet_NaN()
                      : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

double OctomapComparison::octomapCoverage() const {
    return share(surfaceOccupied, surfaceVoxels);
}
double OctomapComparison::ourCoverage() const {
    return share(surfaceOurs, surfaceVoxels);
}
double OctomapComparison::octomapCoverageNear() const {
    return share(surfaceOccupiedNear, surfaceVoxels);
}
double OctomapComparison::ourCoverageNear() const {
    return share(surfaceOursNear, surfaceVoxels);
}

class OctomapCheck::Impl {
 public:
    explicit Impl(double resolution) : tree_(resolution) {}

    void insert(std::span<const Eigen::Vector3f> cloud, const Eigen::Vector3f& origin) {
        octomap::Pointcloud points;
        points.reserve(cloud.size());
        for (const Eigen::Vector3f& p : cloud) {
            if (p.allFinite()) {
                points.push_back(p.x(), p.y(), p.z());
            }
        }
        // Discretised: of the points of one cloud in one voxel one ray is cast.
        tree_.insertPointCloud(points, octomap::point3d(origin.x(), origin.y(), origin.z()), -1.0,
                               false, true);
        ++views_;
    }

    bool occupied(const Key& key) const {
        const octomap::OcTreeNode* node = tree_.search(key);
        return node != nullptr && tree_.isNodeOccupied(*node);
    }
    bool freeAt(const Key& key) const {
        const octomap::OcTreeNode* node = tree_.search(key);
        return node != nullptr && !tree_.isNodeOccupied(*node);
    }

    OctomapComparison compare(std::span<const Eigen::Vector3f> vertices,
                              std::span<const Eigen::Vector3f> surface) const {
        OctomapComparison out;
        out.resolution = tree_.getResolution();
        out.views = views_;
        const VoxelSet ours(tree_, vertices);
        out.ours = ours.keys().size();
        countOctomap(ours, out);
        countVertices(vertices, out);
        countSurface(ours, VoxelSet(tree_, surface), out);
        return out;
    }

    const octomap::OcTree& tree() const { return tree_; }

 private:
    void countOctomap(const VoxelSet& ours, OctomapComparison& out) const {
        for (auto leaf = tree_.begin_leafs(), end = tree_.end_leafs(); leaf != end; ++leaf) {
            // A pruned leaf stands for a cube of voxels.
            const unsigned levels = tree_.getTreeDepth() - leaf.getDepth();
            const std::size_t side = std::size_t{1} << levels;
            if (!tree_.isNodeOccupied(*leaf)) {
                out.free += side * side * side;
                continue;
            }
            out.occupied += side * side * side;
            const Key low = leaf.getIndexKey();
            for (std::size_t i = 0; i < side * side * side; ++i) {
                const Key key(static_cast<octomap::key_type>(low[0] + i % side),
                              static_cast<octomap::key_type>(low[1] + i / side % side),
                              static_cast<octomap::key_type>(low[2] + i / side / side));
                if (!ours.contains(key)) {
                    ++out.occupiedWithoutVertex;
                    out.occupiedFarFromVertex +=
                        !anyAround(key, [&](const Key& k) { return ours.contains(k); });
                }
            }
        }
    }

    void countVertices(std::span<const Eigen::Vector3f> vertices, OctomapComparison& out) const {
        for (const Eigen::Vector3f& p : vertices) {
            Key key;
            if (!p.allFinite() || !tree_.coordToKeyChecked(p.x(), p.y(), p.z(), key)) {
                continue;
            }
            ++out.vertices;
            const octomap::OcTreeNode* node = tree_.search(key);
            if (node == nullptr) {
                ++out.verticesInUnknown;
            } else if (!tree_.isNodeOccupied(*node)) {
                ++out.verticesInFree;
                out.verticesFarInFree += !anyAround(key, [&](const Key& k) { return occupied(k); });
            }
        }
    }

    void countSurface(const VoxelSet& ours, const VoxelSet& surface, OctomapComparison& out) const {
        out.surfaceVoxels = surface.keys().size();
        for (const Key& key : surface.keys()) {
            const bool theirs = occupied(key);
            const bool mine = ours.contains(key);
            out.surfaceOccupied += theirs;
            out.surfaceOurs += mine;
            out.onlyOccupied += theirs && !mine;
            out.onlyOurs += mine && !theirs;
            out.onlyOursFree += mine && freeAt(key);
            out.surfaceOccupiedNear +=
                theirs || anyAround(key, [&](const Key& k) { return occupied(k); });
            out.surfaceOursNear +=
                mine || anyAround(key, [&](const Key& k) { return ours.contains(k); });
        }
    }

    octomap::OcTree tree_;
    std::size_t views_ = 0;
};

OctomapCheck::OctomapCheck(double resolution) {
    if (!(resolution > 0)) {
        throw std::invalid_argument("the OctoMap's resolution must be positive, not " +
                                    std::to_string(resolution));
    }
    impl_ = std::make_unique<Impl>(resolution);
}
OctomapCheck::~OctomapCheck() = default;
OctomapCheck::OctomapCheck(OctomapCheck&&) noexcept = default;
OctomapCheck& OctomapCheck::operator=(OctomapCheck&&) noexcept = default;

void OctomapCheck::insert(std::span<const Eigen::Vector3f> cloud, const Eigen::Vector3f& origin) {
    impl_->insert(cloud, origin);
}

void OctomapCheck::insert(const View& view) {
    std::vector<Eigen::Vector3f> cloud;
    const DisparityImage& d = view.disparity;
    for (int row = 0; row < d.height; ++row) {
        for (int column = 0; column < d.width; ++column) {
            if (d.valid(column, row)) {
                cloud.push_back(
                    (view.world_T_camera *
                     view.camera.backProject(column, row, static_cast<double>(d.at(column, row))))
                        .cast<float>());
            }
        }
    }
    insert(cloud, view.world_T_camera.translation.cast<float>());
}

OctomapComparison OctomapCheck::compare(std::span<const Eigen::Vector3f> vertices,
                                        std::span<const Eigen::Vector3f> surface) const {
    return impl_->compare(vertices, surface);
}

std::function<VoxelOwner(const Eigen::Vector3f&)> OctomapCheck::owners(
    std::span<const Eigen::Vector3f> vertices) const {
    const auto ours = std::make_shared<const VoxelSet>(impl_->tree(), vertices);
    return [ours, impl = impl_.get()](const Eigen::Vector3f& p) {
        Key key;
        if (!impl->tree().coordToKeyChecked(p.x(), p.y(), p.z(), key)) {
            return VoxelOwner::kNeither;
        }
        const bool theirs = impl->occupied(key);
        if (ours->contains(key)) {
            return theirs ? VoxelOwner::kBoth : VoxelOwner::kOnlyOurs;
        }
        return theirs ? VoxelOwner::kOnlyOctomap : VoxelOwner::kNeither;
    };
}

bool OctomapCheck::occupied(const Eigen::Vector3f& point) const {
    Key key;
    return impl_->tree().coordToKeyChecked(point.x(), point.y(), point.z(), key) &&
           impl_->occupied(key);
}

}  // namespace riftmap
