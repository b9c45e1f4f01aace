// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "riftmap/core/view.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/seen_through.h"

namespace riftmap {

/// The vertices of the map within a small cube, taken together. Map frame, metres.
struct SurfaceCell {
    std::uint64_t key = 0;  ///< names the cube; stays the same while the map grows
    Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< mean of the vertices
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();    ///< mean, unit or zero
    /// Length of the mean of the unit normals, 0 to 1: small where both sides of a sheet were seen.
    float oneSided = 0;
    std::uint32_t vertices = 0;
    std::uint32_t open = 0;       ///< vertices that are not closed
    std::uint32_t highEdges = 0;  ///< at the open vertices, each counted at both ends
    std::uint8_t kinds = 0;       ///< OpenKind bits of those
    Eigen::Vector3f openPosition = Eigen::Vector3f::Zero();  ///< mean of the open vertices
    /// Mean of the normals at the tear (of the open vertices that are torn, else of all open
    /// ones), unit or zero: at an edge of a solid the face that ends there, not both.
    Eigen::Vector3f openNormal = Eigen::Vector3f::Zero();
    /// Over the rim: from the neighbours of the open vertices towards where none are; in the
    /// surface, length at most 1 (short where the tear runs around).
    Eigen::Vector3f outward = Eigen::Vector3f::Zero();
    float rim = 0;     ///< length of the tear in this cell, about [m]
    float coarse = 0;  ///< area sampled too sparsely or known too badly, about [m^2]
    /// Area that the tear may hide, counted from both its sides; 0 where `seen` was not given
    /// [m^2].
    float hidden = 0;
    Eigen::Vector3f hiddenPosition = Eigen::Vector3f::Zero();  ///< mean of where it begins
    Eigen::Vector3f hiddenNormal = Eigen::Vector3f::Zero();    ///< mean of Gap::normal
    float doubt = 0;  ///< part of it that is probably farther from the map than was asked [m^2]
    /// Which of the 4 x 4 x 4 parts of the cube hold a vertex: bit (z * 4 + y) * 4 + x.
    std::uint64_t parts = 0;
};

/// The map as the planner looks at it: a few thousand cells instead of millions of vertices, kept
/// up to date from what a view touched, so that planning takes the same time on any map. Reading
/// is thread-safe while nothing writes.
class SurfaceSummary {
 public:
    /// `cell`: edge of a cell [m]; `resolution`: how finely and accurately the surface is asked to
    /// be known [m]; both > 0.
    SurfaceSummary(double cell, double resolution);
    SurfaceSummary(const SurfaceSummary&) = delete;  // its grid points into it
    SurfaceSummary& operator=(const SurfaceSummary&) = delete;

    /// Cells with fewer vertices may be noise: they hide nothing and stand in no way.
    static constexpr std::uint32_t kLeastVertices = 3;

    static constexpr int kCellsPerSide = 8;  ///< of a block, along each edge

    double cellSize() const { return cell_; }
    /// Sums up anew all blocks of cells that this view has surface in or looks through. `seen`:
    /// what all views saw through, for `hidden`.
    void update(const PixelGraph& graph, const View& view, const SeenThrough* seen = nullptr);

    struct Block {
        Eigen::AlignedBox3d box;         ///< of the cube of cells
        std::vector<SurfaceCell> cells;  ///< ascending in key
        /// Their positions once more, a row each: all that drawing them takes.
        Eigen::Matrix<float, Eigen::Dynamic, 3> positions;
        /// SurfaceCell::parts of all its cubes with kLeastVertices, z by y by x; 0 for the
        /// others.
        std::vector<std::uint64_t> parts;
        /// Of the same cubes, where `parts` has none: edge [cells] of the largest cube of 1, 2 or
        /// 4 cells a side around each (the block divided evenly) that holds none either; 0 for the
        /// others.
        std::vector<std::uint8_t> emptyAround;
    };
    /// All blocks by key, in ascending order.
    const std::map<std::uint64_t, Block>& blocks() const { return blocks_; }
    /// Keys of the blocks that the last update worked on, ascending; some may hold no cell, before
    /// and after.
    const std::vector<std::uint64_t>& changed() const { return changed_; }
    /// The same blocks as they were before it; empty ones for those that are new.
    const std::vector<Block>& former() const { return former_; }
    /// Key of the block of a cell.
    static std::uint64_t blockOf(std::uint64_t cell);
    /// False if something known stands before a place, as seen from `eye`: if a part (Block::parts)
    /// that holds a vertex is met on the line between them, at places 0.75 of its edge apart, no
    /// farther than `reach` cells from the place. The first 2.2 edges of a part do not count, for
    /// there stands the rim that the place lies beside. What is empty is passed over:
    /// 0.2 to 0.3 us for a line out of an object (./run bench planner).
    bool openTowards(const Eigen::Vector3f& place, const Eigen::Vector3f& eye, float reach) const;
    /// Nothing if the cell holds no vertex.
    const SurfaceCell* find(std::uint64_t key) const;
    std::uint64_t keyOf(const Eigen::Vector3d& point) const;
    /// Which cube a key names, counted from the origin along x, y and z; and its key.
    static Eigen::Vector3i indexOf(std::uint64_t key);
    static std::uint64_t keyAt(const Eigen::Vector3i& index);
    /// Added to a cell's key: the keys of 13 of the 26 cells around it, those that are larger.
    static std::array<std::uint64_t, 13> neighbourOffsets();
    std::size_t cellCount() const { return cellCount_; }
    /// Area of a face of each cell, all together: about 1.5 times the surface's [m^2].
    double area() const { return static_cast<double>(cellCount_) * cell_ * cell_; }
    /// Area that the last update found where there was none [m^2]: in parts of cells (a quarter of
    /// their edge, the target resolution by default) that hold a vertex while neither they nor one
    /// that shares a face with them did before. A sheet crosses 1.5 parts for each of their faces'
    /// area on average over its directions, which is taken into account, unlike in area().
    double newArea() const { return newArea_; }
    /// Area of the cells that is sampled too sparsely or known too badly, all together [m^2].
    double coarseArea() const { return coarseArea_; }

 private:
    Block build(const PixelGraph& graph, std::uint64_t blockKey, const SeenThrough* seen) const;
    std::vector<std::uint64_t> blocksSeen(const View& view) const;
    std::size_t newParts(const Block& now) const;
    void spreadBlocks();
    const Block* blockAt(const Eigen::Vector3i& at) const;

    double cell_, resolution_;
    std::map<std::uint64_t, Block> blocks_;
    /// blocks_ by where they are; empty if that would take too much.
    struct Grid {
        Eigen::Vector3i low = Eigen::Vector3i::Zero(), size = Eigen::Vector3i::Zero();
        std::vector<const Block*> blocks;

        bool holds(const Eigen::Vector3i& in) const {
            return (in.array() >= 0).all() && (in.array() < size.array()).all();
        }
        std::size_t index(const Eigen::Vector3i& in) const {
            const std::ptrdiff_t row = std::ptrdiff_t{in.z()} * size.y() + in.y();
            return static_cast<std::size_t>(row * size.x() + in.x());
        }
    };
    Grid grid_;
    Eigen::AlignedBox3f box_;  ///< around all blocks there ever were
    std::vector<std::uint64_t> changed_;
    std::vector<Block> former_;
    std::size_t cellCount_ = 0;
    double coarseArea_ = 0;
    double newArea_ = 0;
};

}  // namespace riftmap
