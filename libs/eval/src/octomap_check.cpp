// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/octomap_check.h"

#include <octomap/OcTree.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>

#include "voxel_set.h"

namespace riftmap {

namespace {

using octomap::OcTreeKey;

constexpr double kClipped = 0.1;  ///< of a face's area

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
double OctomapComparison::vertexCoverage() const {
    return share(surfaceVertex, surfaceVoxels);
}
double OctomapComparison::octomapCoverageNear() const {
    return share(surfaceOccupiedNear, surfaceVoxels);
}
double OctomapComparison::ourCoverageNear() const {
    return share(surfaceOursNear, surfaceVoxels);
}

double sectionArea(const Eigen::Vector3d& cubeMin, double edge, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& normal) {
    // A square of the plane, larger than the cube, cut by the six faces (Sutherland-Hodgman).
    const Eigen::Vector3d u = normal.unitOrthogonal();
    const Eigen::Vector3d v = normal.cross(u);
    const Eigen::Vector3d middle = cubeMin + Eigen::Vector3d::Constant(edge / 2);
    const Eigen::Vector3d foot = middle + normal * normal.dot(point - middle);
    std::vector<Eigen::Vector3d> polygon = {foot + edge * (u + v), foot + edge * (v - u),
                                            foot - edge * (u + v), foot + edge * (u - v)};
    std::vector<Eigen::Vector3d> rest;
    for (int face = 0; face < 6 && !polygon.empty(); ++face) {
        const int axis = face / 2;
        const auto inside = [&](const Eigen::Vector3d& p) {  // how far
            const double above = p[axis] - cubeMin[axis];
            return face % 2 == 0 ? above : edge - above;
        };
        rest.clear();
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const Eigen::Vector3d& a = polygon[i];
            const Eigen::Vector3d& b = polygon[(i + 1) % polygon.size()];
            const double atA = inside(a);
            const double atB = inside(b);
            if (atA >= 0) {
                rest.push_back(a);
            }
            if ((atA >= 0) != (atB >= 0)) {
                rest.push_back(a + (b - a) * (atA / (atA - atB)));
            }
        }
        polygon.swap(rest);
    }
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 2; i < polygon.size(); ++i) {
        sum += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
    }
    return sum.norm() / 2;
}

class OctomapCheck::Impl {
 public:
    Impl(double resolution, const Eigen::Vector3f& shift)
        : tree_(resolution), shift_(shift.cast<double>() * resolution) {}

    void insert(std::span<const Eigen::Vector3f> cloud, const Eigen::Vector3f& origin) {
        octomap::Pointcloud points;
        points.reserve(cloud.size());
        for (const Eigen::Vector3f& p : cloud) {
            if (p.allFinite()) {
                points.push_back(inTree(p));
            }
        }
        // Discretised: of the points of one cloud in one voxel one ray is cast.
        tree_.insertPointCloud(points, inTree(origin), -1.0, false, true);
        ++views_;
    }

    bool occupied(Voxel voxel) const {
        const octomap::OcTreeNode* node = nodeAt(voxel);
        return node != nullptr && tree_.isNodeOccupied(*node);
    }

    std::optional<Voxel> voxelOf(const Eigen::Vector3f& p) const {
        OcTreeKey key;
        if (!p.allFinite() || !tree_.coordToKeyChecked(inTree(p), key)) {
            return std::nullopt;
        }
        return Voxel::of(key[0], key[1], key[2]);
    }
    double resolution() const { return tree_.getResolution(); }

    /// The voxels that our surface passes through, to a thirty-second of their edge, give or take
    /// its standard deviation. A triangle longer than that edge would bridge what at this
    /// resolution is a gap; a deviation beyond it says nothing at this resolution.
    VoxelSet voxelsOf(const MapSurface& map) const {
        VoxelSet out;
        const auto edge = static_cast<float>(resolution());
        std::vector<Eigen::Vector3f> deviations(map.vertices.size(), Eigen::Vector3f::Zero());
        for (std::size_t i = 0; i < map.vertices.size(); ++i) {
            const Eigen::Vector3f& p = map.vertices[i];
            if (!map.deviations.empty()) {
                const float size = map.deviations[i].norm();
                deviations[i] = map.deviations[i] * (size > edge ? edge / size : 1.0F);
            }
            addTriangle({p - deviations[i], p + deviations[i], p + deviations[i]}, out);
        }
        const auto apart = [&](std::uint32_t a, std::uint32_t b) {
            return (map.vertices[a] - map.vertices[b]).norm();
        };
        for (const auto& [a, b, c] : map.triangles) {
            if (std::max({apart(a, b), apart(b, c), apart(c, a)}) > edge) {
                continue;
            }
            for (const float side : {-1.0F, 0.0F, 1.0F}) {
                addTriangle(
                    {map.vertices[a] + side * deviations[a], map.vertices[b] + side * deviations[b],
                     map.vertices[c] + side * deviations[c]},
                    out);
            }
        }
        out.finish();
        return out;
    }

    /// The voxels that hold a vertex.
    VoxelSet voxelsHolding(std::span<const Eigen::Vector3f> vertices) const {
        VoxelSet out;
        for (const Eigen::Vector3f& p : vertices) {
            if (const auto voxel = voxelOf(p)) {
                out.add(*voxel);
            }
        }
        out.finish();
        return out;
    }

    /// The voxels of the samples, and of those the ones that the truth only clips.
    struct Truth {
        VoxelSet voxels, clipped;
    };
    Truth truthOf(const TrueSurface& truth) const {
        std::map<std::uint64_t, double> area;  // the largest that a sample says
        for (std::size_t i = 0; i < truth.points.size(); ++i) {
            if (const auto voxel = voxelOf(truth.points[i])) {
                double& largest = area[voxel->code];
                if (largest < kClipped * resolution() * resolution()) {
                    largest = std::max(largest, sectionArea(cornerOf(*voxel), resolution(),
                                                            truth.points[i].cast<double>(),
                                                            truth.normals[i].cast<double>()));
                }
            }
        }
        Truth out;
        for (const auto& [code, largest] : area) {
            out.voxels.add(Voxel{code});
            if (largest < kClipped * resolution() * resolution()) {
                out.clipped.add(Voxel{code});
            }
        }
        out.voxels.finish();
        out.clipped.finish();
        return out;
    }

    VoxelOwner owner(Voxel voxel, const VoxelSet& ours, const VoxelSet& clipped) const {
        const bool mine = ours.contains(voxel);
        const octomap::OcTreeNode* node = nodeAt(voxel);
        const bool theirs = node != nullptr && tree_.isNodeOccupied(*node);
        if (mine) {
            return theirs            ? VoxelOwner::kBoth
                   : node != nullptr ? VoxelOwner::kOursCarved
                                     : VoxelOwner::kOursUnknown;
        }
        if (!theirs) {
            return VoxelOwner::kNeither;
        }
        if (clipped.contains(voxel)) {
            return VoxelOwner::kOctomapClipped;
        }
        const bool beside = voxel.anyAround([&](Voxel v) { return ours.contains(v); });
        return beside ? VoxelOwner::kOctomapBeside : VoxelOwner::kOctomapMissed;
    }

    OctomapComparison compare(const MapSurface& map, const TrueSurface& surface) const {
        OctomapComparison out;
        out.resolution = resolution();
        out.views = views_;
        const VoxelSet ours = voxelsOf(map);
        const VoxelSet holding = voxelsHolding(map.vertices);
        const Truth truth = truthOf(surface);
        countOctomap(ours, truth.voxels, out);
        countOurs(ours, truth.voxels, out);
        countVertices(map.vertices, out);
        for (const Voxel voxel : truth.voxels) {
            countSurface(voxel, ours, holding, truth, out);
        }
        return out;
    }

 private:
    octomap::point3d inTree(const Eigen::Vector3f& p) const {
        const Eigen::Vector3d q = p.cast<double>() + shift_;
        return {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z())};
    }
    Eigen::Vector3d cornerOf(Voxel voxel) const {
        Eigen::Vector3d corner;
        for (int a = 0; a < 3; ++a) {
            corner[a] = tree_.keyToCoord(voxel.at(a)) - resolution() / 2 - shift_[a];
        }
        return corner;
    }
    const octomap::OcTreeNode* nodeAt(Voxel voxel) const {
        return tree_.search(OcTreeKey(voxel.at(0), voxel.at(1), voxel.at(2)));
    }

    void addTriangle(const std::array<Eigen::Vector3f, 3>& t, VoxelSet& out) const {
        const std::array<std::optional<Voxel>, 3> at = {voxelOf(t[0]), voxelOf(t[1]),
                                                        voxelOf(t[2])};
        const std::array<float, 3> length = {(t[1] - t[0]).norm(), (t[2] - t[1]).norm(),
                                             (t[0] - t[2]).norm()};
        const auto longest = static_cast<std::size_t>(
            std::max_element(length.begin(), length.end()) - length.begin());
        // A voxel is convex: it holds a triangle whose corners it holds. Not finite: no length.
        if ((at[0] == at[1] && at[0] == at[2]) ||
            !(length[longest] >= static_cast<float>(resolution() / 32))) {
            for (const auto& voxel : at) {
                if (voxel) {
                    out.add(*voxel);
                }
            }
            return;
        }
        const Eigen::Vector3f& from = t[longest];
        const Eigen::Vector3f& to = t[(longest + 1) % 3];
        const Eigen::Vector3f& tip = t[(longest + 2) % 3];
        const Eigen::Vector3f middle = (from + to) / 2;
        addTriangle({from, middle, tip}, out);
        addTriangle({middle, to, tip}, out);
    }

    void countOctomap(const VoxelSet& ours, const VoxelSet& truth, OctomapComparison& out) const {
        for (auto leaf = tree_.begin_leafs(), end = tree_.end_leafs(); leaf != end; ++leaf) {
            // A pruned leaf stands for a cube of voxels.
            const std::size_t side = std::size_t{1} << (tree_.getTreeDepth() - leaf.getDepth());
            if (!tree_.isNodeOccupied(*leaf)) {
                out.free += side * side * side;
                continue;
            }
            out.occupied += side * side * side;
            const OcTreeKey low = leaf.getIndexKey();
            for (std::size_t i = 0; i < side * side * side; ++i) {
                const Voxel voxel = Voxel::of(low[0] + i % side, low[1] + i / side % side,
                                              low[2] + i / side / side);
                if (!ours.contains(voxel)) {
                    ++out.occupiedNotOurs;
                    out.occupiedFarFromOurs += isFar(voxel, ours);
                }
                if (!truth.empty() && !truth.contains(voxel)) {
                    ++out.occupiedOffSurface;
                    out.occupiedFarOff += isFar(voxel, truth);
                }
            }
        }
    }

    static bool isFar(Voxel voxel, const VoxelSet& from) {
        return !voxel.anyAround([&](Voxel v) { return from.contains(v); });
    }

    static void countOurs(const VoxelSet& ours, const VoxelSet& truth, OctomapComparison& out) {
        out.ours = ours.size();
        if (truth.empty()) {
            return;
        }
        for (const Voxel voxel : ours) {
            if (!truth.contains(voxel)) {
                ++out.oursOffSurface;
                out.oursFarOff += isFar(voxel, truth);
            }
        }
    }

    void countVertices(std::span<const Eigen::Vector3f> vertices, OctomapComparison& out) const {
        for (const Eigen::Vector3f& p : vertices) {
            const auto voxel = voxelOf(p);
            if (!voxel) {
                continue;
            }
            ++out.vertices;
            const octomap::OcTreeNode* node = nodeAt(*voxel);
            if (node == nullptr) {
                ++out.verticesInUnknown;
            } else if (!tree_.isNodeOccupied(*node)) {
                ++out.verticesInFree;
                out.verticesFarInFree +=
                    !voxel->anyAround([&](Voxel v) { return this->occupied(v); });
            }
        }
    }

    void countSurface(Voxel voxel, const VoxelSet& ours, const VoxelSet& holding,
                      const Truth& truth, OctomapComparison& out) const {
        ++out.surfaceVoxels;
        const VoxelOwner who = owner(voxel, ours, truth.clipped);
        const bool mine = ours.contains(voxel);
        const bool theirs = who != VoxelOwner::kNeither && who != VoxelOwner::kOursCarved &&
                            who != VoxelOwner::kOursUnknown;
        out.surfaceOccupied += theirs;
        out.surfaceOurs += mine;
        out.surfaceVertex += holding.contains(voxel);
        out.surfaceOccupiedNear +=
            theirs || voxel.anyAround([&](Voxel v) { return this->occupied(v); });
        out.surfaceOursNear += mine || !isFar(voxel, ours);
        out.onlyOccupiedClipped += who == VoxelOwner::kOctomapClipped;
        out.onlyOccupiedBeside += who == VoxelOwner::kOctomapBeside;
        out.onlyOccupiedMissed += who == VoxelOwner::kOctomapMissed;
        out.onlyOursFree += who == VoxelOwner::kOursCarved;
        out.onlyOursUnknown += who == VoxelOwner::kOursUnknown;
    }

    octomap::OcTree tree_;
    Eigen::Vector3d shift_;  ///< of the map frame in the tree's [m]
    std::size_t views_ = 0;
};

OctomapCheck::OctomapCheck(double resolution, const Eigen::Vector3f& shift) {
    if (!(resolution > 0)) {
        throw std::invalid_argument("the OctoMap's resolution must be positive, not " +
                                    std::to_string(resolution));
    }
    impl_ = std::make_unique<Impl>(resolution, shift);
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

OctomapComparison OctomapCheck::compare(const MapSurface& map, const TrueSurface& truth) const {
    return impl_->compare(map, truth);
}

VoxelOwners OctomapCheck::owners(const MapSurface& map, const TrueSurface& truth) const {
    const auto ours = std::make_shared<const VoxelSet>(impl_->voxelsOf(map));
    const auto clipped = std::make_shared<const VoxelSet>(impl_->truthOf(truth).clipped);
    return [ours, clipped, impl = impl_.get()](const Eigen::Vector3f& p) {
        const auto voxel = impl->voxelOf(p);
        return voxel ? impl->owner(*voxel, *ours, *clipped) : VoxelOwner::kNeither;
    };
}

bool OctomapCheck::occupied(const Eigen::Vector3f& point) const {
    const auto voxel = impl_->voxelOf(point);
    return voxel && impl_->occupied(*voxel);
}

}  // namespace riftmap
