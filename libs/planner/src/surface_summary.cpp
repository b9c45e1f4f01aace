// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/surface_summary.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "riftmap/core/parallel.h"
#include "riftmap/core/whole.h"
#include "riftmap/planner/seen_through.h"

namespace riftmap {

namespace {

constexpr int kOffset = 1 << 20;  ///< cells from the origin to either side

std::uint64_t pack(const Eigen::Vector3i& v) {
    const auto part = [](int x) { return static_cast<std::uint64_t>(x + kOffset) & 0x1FFFFFU; };
    return part(v.z()) << 42 | part(v.y()) << 21 | part(v.x());
}

Eigen::Vector3i unpack(std::uint64_t key) {
    const auto part = [&](int shift) {
        return static_cast<int>(key >> shift & 0x1FFFFFU) - kOffset;
    };
    return {part(0), part(21), part(42)};
}

/// Sums while the vertices of a block go by.
struct Sums {
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d openPosition = Eigen::Vector3d::Zero(), outward = Eigen::Vector3d::Zero();
    Eigen::Vector3d tornNormal = Eigen::Vector3d::Zero(), coarseNormal = Eigen::Vector3d::Zero();
    double doubt = 0, hidden = 0;
    Eigen::Vector3d hiddenPosition = Eigen::Vector3d::Zero();
    Eigen::Vector3d hiddenNormal = Eigen::Vector3d::Zero();
    std::uint32_t hides = 0;
    std::uint32_t vertices = 0, torn = 0, coarse = 0, open = 0, high = 0;
    std::uint8_t kinds = 0;
    std::uint64_t parts = 0;
};

constexpr int kParts = 4;  ///< of a cell, along each axis

/// In SurfaceCell::parts.
std::uint64_t partBit(const Eigen::Vector3i& part) {
    return std::uint64_t{1} << ((part.z() * kParts + part.y()) * kParts + part.x());
}

/// From the neighbours towards the vertex and on: out of the surface seen so far.
Eigen::Vector3d outwardAt(const PixelGraph& graph, VertexId id, const Vertex& v, Sums& sums) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    graph.forEachEdge(id, [&](VertexId to, float, bool high) {
        if (high) {
            ++sums.high;
        } else {
            sum += (v.position - graph.position(to)).cast<double>().normalized();
        }
    });
    const Eigen::Vector3d n = v.normal.cast<double>();
    sum -= n * n.dot(sum);
    const double length = sum.norm();
    return length > 1.0 ? Eigen::Vector3d(sum / length) : sum;
}

/// The gap beside a torn vertex. Where no normal tells in which direction it may lie: as wide as
/// one may be, unless all around was seen through.
std::optional<Gap> gapAt(const PixelGraph& graph, const SeenThrough::Views& seen, const Vertex& v,
                         const Eigen::Vector3d& outward, double resolution) {
    const Eigen::Vector3d p = v.position.cast<double>();
    const Eigen::Vector3d n = v.normal.cast<double>();
    if (n.norm() < 0.5) {
        bool dark = false;
        for (int i = 0; i < 6 && !dark; ++i) {
            const Eigen::Vector3d side = (i < 3 ? 1.5 : -1.5) * Eigen::Vector3d::Unit(i % 3);
            dark = !seen.seeThrough(p + resolution * side);
        }
        return dark ? std::optional(Gap{kWidestGap * resolution, p, Eigen::Vector3d::Zero()})
                    : std::nullopt;
    }
    if (outward.norm() > 0.25) {
        return gapBeside(graph, seen, p, n, outward.normalized(), resolution);
    }
    // Torn to opposite sides, as in surface seen at a flat angle.
    const Eigen::Vector3d u = n.unitOrthogonal();
    const Eigen::Vector3d w = n.cross(u);
    std::optional<Gap> widest;
    for (const Eigen::Vector3d& side : {u, Eigen::Vector3d(-u), w, Eigen::Vector3d(-w)}) {
        const auto gap = gapBeside(graph, seen, p, n, side, resolution);
        if (gap && (!widest || gap->width > widest->width)) {
            widest = gap;
        }
    }
    return widest;
}

/// Longest edge to a neighbour on the same surface [m].
double spacingAt(const PixelGraph& graph, VertexId id) {
    double longest = 1e-6;
    graph.forEachEdge(id, [&](VertexId, float weight, bool high) {
        longest = high ? longest : std::max(longest, static_cast<double>(weight));
    });
    return longest;
}

/// Share of the surface at a coarse vertex that is not within the resolution of the map: for its
/// noise is Gaussian along the ray, and for what lies between vertices that are too far apart.
double shareInDoubt(float sigma, double spacing, double resolution) {
    constexpr double kAcross = 0.75;  // part of an error along the ray that is off the surface
    const double between = std::clamp(1.0 - 1.6 * resolution / spacing, 0.005, 1.0);
    return between + (sigma > 0 ? std::erfc(resolution /
                                            (std::sqrt(2.0) * kAcross * static_cast<double>(sigma)))
                                : 0.0);
}

SurfaceCell toCell(const Sums& s, std::uint64_t key, double cell) {
    SurfaceCell c;
    c.key = key;
    c.vertices = s.vertices;
    c.open = s.open;
    c.highEdges = s.high;
    c.kinds = s.kinds;
    c.parts = s.parts;
    c.position = (s.position / s.vertices).cast<float>();
    if (s.normal.norm() > 1e-6) {
        c.normal = s.normal.normalized().cast<float>();
        c.oneSided = static_cast<float>(s.normal.norm() / s.vertices);
    }
    // A sheet across the cell holds about (cell / spacing)^2 vertices.
    const double spacing = cell / std::sqrt(static_cast<double>(s.vertices));
    if (s.open > 0) {
        c.openPosition = (s.openPosition / s.open).cast<float>();
        const Eigen::Vector3d& normal = s.torn > 0 ? s.tornNormal : s.coarseNormal;
        if (normal.norm() > 1e-6) {
            c.openNormal = normal.normalized().cast<float>();
        }
        c.rim = static_cast<float>(std::min(s.torn * spacing, 2.0 * cell));
        c.coarse = static_cast<float>(cell * cell * s.coarse / s.vertices);
        c.doubt = static_cast<float>(cell * cell * s.doubt / s.vertices);
    }
    if (s.torn > 0) {
        c.outward = (s.outward / s.torn).cast<float>();
        const double most = std::min(1.0, 2.0 * cell / (s.torn * spacing));
        c.hidden = static_cast<float>(s.hidden * spacing * most);
        if (s.hides > 0) {
            c.hiddenPosition = (s.hiddenPosition / s.hides).cast<float>();
            c.hiddenNormal = (s.hiddenNormal / s.hides).cast<float>();
        }
    }
    return c;
}

/// Of a cell, counted from the block's corner, in lists of all its cells.
std::size_t indexInBlock(const Eigen::Vector3i& cell) {
    constexpr int n = SurfaceSummary::kCellsPerSide;
    const std::ptrdiff_t row = std::ptrdiff_t{cell.z()} * n + cell.y();
    return static_cast<std::size_t>(row * n + cell.x());
}

/// SurfaceSummary::Block::emptyAround
std::vector<std::uint8_t> emptyAround(const std::vector<std::uint64_t>& parts) {
    std::vector<std::uint8_t> edges(parts.size(), 0);
    for (int edge = 1; edge < SurfaceSummary::kCellsPerSide; edge *= 2) {
        const int n = SurfaceSummary::kCellsPerSide / edge;
        const auto forEachIn = [&](const Eigen::Vector3i& cube, const auto& f) {
            for (int i = 0; i < edge * edge * edge; ++i) {
                f(indexInBlock(edge * cube +
                               Eigen::Vector3i(i % edge, i / edge % edge, i / edge / edge)));
            }
        };
        for (int i = 0; i < n * n * n; ++i) {
            const Eigen::Vector3i cube(i % n, i / n % n, i / n / n);
            std::uint64_t held = 0;
            forEachIn(cube, [&](std::size_t cell) { held |= parts[cell]; });
            if (held == 0) {
                forEachIn(cube,
                          [&](std::size_t cell) { edges[cell] = static_cast<std::uint8_t>(edge); });
            }
        }
    }
    return edges;
}

double coarseIn(const SurfaceSummary::Block& block) {
    double area = 0;
    for (const SurfaceCell& cell : block.cells) {
        area += static_cast<double>(cell.coarse);
    }
    return area;
}

}  // namespace

SurfaceSummary::SurfaceSummary(double cell, double resolution)
    : cell_(cell), resolution_(resolution) {
    if (!(cell > 0) || !(resolution > 0)) {
        throw std::invalid_argument(
            "surface summary: the cell size and the resolution must be positive");
    }
}

std::uint64_t SurfaceSummary::keyOf(const Eigen::Vector3d& point) const {
    return pack(wholesBelow(point / cell_));
}

std::uint64_t SurfaceSummary::blockOf(std::uint64_t cell) {
    static_assert(kCellsPerSide == 8);
    return pack(unpack(cell).unaryExpr([](int x) { return x >> 3; }));
}

Eigen::Vector3i SurfaceSummary::indexOf(std::uint64_t key) {
    return unpack(key);
}

std::uint64_t SurfaceSummary::keyAt(const Eigen::Vector3i& index) {
    return pack(index);
}

std::array<std::uint64_t, 13> SurfaceSummary::neighbourOffsets() {
    std::array<std::uint64_t, 13> offsets{};
    const std::uint64_t middle = pack(Eigen::Vector3i::Zero());
    for (int i = 0; i < 13; ++i) {  // in the order of their keys, from the middle on
        offsets[static_cast<std::size_t>(i)] = pack(aroundVoxel(i + 14)) - middle;
    }
    return offsets;
}

const SurfaceCell* SurfaceSummary::find(std::uint64_t key) const {
    const auto it = blocks_.find(blockOf(key));
    if (it == blocks_.end()) {
        return nullptr;
    }
    const auto& cells = it->second.cells;
    const auto c =
        std::lower_bound(cells.begin(), cells.end(), key,
                         [](const SurfaceCell& a, std::uint64_t k) { return a.key < k; });
    return c != cells.end() && c->key == key ? &*c : nullptr;
}

/// Spreads the blocks over a grid, so that a line that meets many need not search for each.
void SurfaceSummary::spreadBlocks() {
    constexpr double kMost = 1 << 20;
    grid_ = {};
    Eigen::AlignedBox3i box;
    for (const auto& [key, block] : blocks_) {
        box.extend(unpack(key));
    }
    if (blocks_.empty() || (box.sizes().cast<double>().array() + 1).prod() > kMost) {
        return;  // or a few of them lie far off
    }
    grid_.low = box.min();
    grid_.size = box.sizes() + Eigen::Vector3i::Ones();
    grid_.blocks.assign(static_cast<std::size_t>(grid_.size.prod()), nullptr);
    for (const auto& [key, block] : blocks_) {
        grid_.blocks[grid_.index(unpack(key) - grid_.low)] = &block;
    }
}

const SurfaceSummary::Block* SurfaceSummary::blockAt(const Eigen::Vector3i& at) const {
    const Eigen::Vector3i in = at - grid_.low;
    if (grid_.holds(in)) {
        return grid_.blocks[grid_.index(in)];
    }
    const auto it = grid_.blocks.empty() ? blocks_.find(pack(at)) : blocks_.end();
    return it == blocks_.end() ? nullptr : &it->second;
}

bool SurfaceSummary::openTowards(const Eigen::Vector3f& place, const Eigen::Vector3f& eye,
                                 float reach) const {
    constexpr float kFirst = 2.2F, kStep = 0.75F;  // [parts]
    static_assert(kParts == 4);
    const float scale = kParts / static_cast<float>(cell_);
    const Eigen::Vector3f start = scale * place;
    const Eigen::Vector3f way = scale * eye - start;
    const Eigen::Vector3f out = way.normalized();
    const Eigen::Array3f inverse =
        out.unaryExpr([](float x) { return 1 / std::copysign(std::max(std::abs(x), 1e-6F), x); });
    // Beyond all blocks there is nothing.
    const Eigen::Array3f edges = (inverse > 0).select(scale * box_.max(), scale * box_.min());
    const float outside = ((edges - start.array()) * inverse).minCoeff();
    const float end = std::min({kParts * reach, way.norm(), outside});
    // The block that the line is in; none was looked for yet.
    Eigen::Vector3i at = Eigen::Vector3i::Constant(kOffset);
    const Block* block = nullptr;
    for (float s = kFirst; s < end;) {
        const Eigen::Vector3f p = start + s * out;
        const Eigen::Vector3i part = wholesBelow(p);
        const Eigen::Vector3i now = part.unaryExpr([](int x) { return x >> 5; });
        if (now != at) {
            at = now;
            block = blockAt(at);
        }
        int empty = kParts * kCellsPerSide;  // [parts] edge of a cube here that holds nothing
        if (block != nullptr) {
            const Eigen::Vector3i cell = part.unaryExpr([](int x) { return x >> 2; });
            const std::size_t in = indexInBlock(cell.unaryExpr([](int x) { return x & 7; }));
            empty = kParts * block->emptyAround[in];
            if (empty == 0) {
                if ((block->parts[in] & partBit(part - kParts * cell)) != 0) {
                    return false;
                }
                s += kStep;
                continue;
            }
        }
        // The last of these places that surely lies in that cube.
        const Eigen::Array3f low = part.unaryExpr([&](int x) { return x & -empty; }).cast<float>();
        const Eigen::Array3f side = (inverse > 0).select(low + static_cast<float>(empty), low);
        const float across = ((side - p.array()) * inverse).minCoeff();
        s += kStep * static_cast<float>(std::max(1, static_cast<int>(across / kStep)));
    }
    return true;
}

/// Keys of the blocks that lie within the resolution of a point of the view, of every second along
/// rows and columns: rounding and fusion may have put its vertex into the next block. In no order,
/// some more than once.
std::vector<std::uint64_t> SurfaceSummary::blocksSeen(const View& view) const {
    const double side = kCellsPerSide * cell_;
    std::vector<std::uint64_t> keys;
    Eigen::Vector3i lastLow = Eigen::Vector3i::Constant(kOffset);
    Eigen::Vector3i lastHigh = lastLow;
    const DisparityImage& d = view.disparity;
    // A disparity of 0 is valid and infinitely far off: no vertex, and in no block.
    const double farthest = 0.5 * kOffset * cell_;
    for (int row = 0; row < d.height; row += 2) {
        for (int column = 0; column < d.width; column += 2) {
            if (!d.valid(column, row)) {
                continue;
            }
            const Eigen::Vector3d inCamera =
                view.camera.backProject(column, row, static_cast<double>(d.at(column, row)));
            if (!(inCamera.norm() < farthest)) {
                continue;
            }
            const Eigen::Vector3d p = view.world_T_camera * inCamera;
            const Eigen::Vector3i low = wholesBelow((p.array() - resolution_) / side);
            const Eigen::Vector3i high = wholesBelow((p.array() + resolution_) / side);
            if (low == lastLow && high == lastHigh) {
                continue;
            }
            lastLow = low;
            lastHigh = high;
            for (int z = low.z(); z <= high.z(); ++z) {
                for (int y = low.y(); y <= high.y(); ++y) {
                    for (int x = low.x(); x <= high.x(); ++x) {
                        keys.push_back(pack({x, y, z}));
                    }
                }
            }
        }
    }
    return keys;
}

void SurfaceSummary::update(const PixelGraph& graph, const View& view, const SeenThrough* seen) {
    changed_ = blocksSeen(view);
    const DisparityImage& d = view.disparity;
    // Blocks that the view may have seen through lose vertices without gaining any.
    const Pose camera_T_world = view.world_T_camera.inverse();
    for (const auto& [key, block] : blocks_) {
        const Eigen::Vector3d p = camera_T_world * Eigen::Vector3d(block.box.center());
        if (p.z() < 0.1) {
            continue;
        }
        const Eigen::Vector2d uv = view.camera.project(p);
        const double radius = view.camera.fx * block.box.diagonal().norm() / 2 / p.z();
        bool through = false;
        for (const double du : {-0.6, 0.0, 0.6}) {
            for (const double dv : {-0.6, 0.0, 0.6}) {
                const auto column = static_cast<int>(std::lround(uv.x() + du * radius));
                const auto row = static_cast<int>(std::lround(uv.y() + dv * radius));
                through =
                    through || (column >= 0 && row >= 0 && column < d.width && row < d.height &&
                                d.valid(column, row) &&
                                view.camera.depth(static_cast<double>(d.at(column, row))) > p.z());
            }
        }
        if (through) {
            changed_.push_back(key);
        }
    }
    std::sort(changed_.begin(), changed_.end());
    changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
    std::vector<Block> rebuilt(changed_.size());
    parallelForEach(changed_.size(), 1,
                    [&](std::size_t i) { rebuilt[i] = build(graph, changed_[i], seen); });
    std::vector<std::size_t> isNew(changed_.size());
    parallelForEach(changed_.size(), 1, [&](std::size_t i) { isNew[i] = newParts(rebuilt[i]); });
    newArea_ = static_cast<double>(std::accumulate(isNew.begin(), isNew.end(), std::size_t{0})) *
               std::pow(cell_ / kParts, 2) / 1.5;
    former_.assign(changed_.size(), {});
    bool sameBlocks = true;
    for (std::size_t i = 0; i < changed_.size(); ++i) {
        const auto it = blocks_.find(changed_[i]);
        if (it != blocks_.end()) {
            former_[i] = std::move(it->second);
        }
        cellCount_ += rebuilt[i].cells.size() - former_[i].cells.size();
        coarseArea_ += coarseIn(rebuilt[i]) - coarseIn(former_[i]);
        sameBlocks = sameBlocks && (it != blocks_.end()) != rebuilt[i].cells.empty();
        if (!rebuilt[i].cells.empty()) {
            box_.extend(rebuilt[i].box.cast<float>());
            blocks_[changed_[i]] = std::move(rebuilt[i]);
        } else if (it != blocks_.end()) {
            blocks_.erase(it);
        }
    }
    if (!sameBlocks) {
        spreadBlocks();
    }
}

/// Parts of the block's cells that hold a vertex while neither they nor a part that shares a face
/// with them did before.
std::size_t SurfaceSummary::newParts(const Block& now) const {
    const auto before = [&](const Eigen::Vector3i& cell) {
        const SurfaceCell* c = find(pack(cell));
        return c == nullptr ? std::uint64_t{0} : c->parts;
    };
    // Parts at the lower and upper faces of a cell, see partBit().
    constexpr std::uint64_t kX0 = 0x1111111111111111, kX3 = kX0 << 3;
    constexpr std::uint64_t kY0 = 0x000F000F000F000F, kY3 = kY0 << 12;
    std::size_t count = 0;
    for (const SurfaceCell& cell : now.cells) {
        const Eigen::Vector3i at = unpack(cell.key);
        const std::uint64_t own = before(at);
        if ((cell.parts & ~own) == 0) {
            continue;
        }
        std::uint64_t known = own;
        known |= (own & ~kX3) << 1 | (own & ~kX0) >> 1;
        known |= (own & ~kY3) << 4 | (own & ~kY0) >> 4;
        known |= own << 16 | own >> 16;
        known |= (before(at + Eigen::Vector3i::UnitX()) & kX0) << 3;
        known |= (before(at - Eigen::Vector3i::UnitX()) & kX3) >> 3;
        known |= (before(at + Eigen::Vector3i::UnitY()) & kY0) << 12;
        known |= (before(at - Eigen::Vector3i::UnitY()) & kY3) >> 12;
        known |= before(at + Eigen::Vector3i::UnitZ()) << 48;
        known |= before(at - Eigen::Vector3i::UnitZ()) >> 48;
        count += static_cast<std::size_t>(std::popcount(cell.parts & ~known));
    }
    return count;
}

SurfaceSummary::Block SurfaceSummary::build(const PixelGraph& graph, std::uint64_t blockKey,
                                            const SeenThrough* seen) const {
    constexpr int n = kCellsPerSide;
    const Eigen::Vector3i corner = unpack(blockKey) * n;
    const Eigen::Vector3d min = corner.cast<double>() * cell_;
    const Eigen::Vector3d max = min + Eigen::Vector3d::Constant(n * cell_);
    const double beside = (kWidestGap + 2) * resolution_;  // where gaps are looked for
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(beside);
    const auto views = seen == nullptr
                           ? SeenThrough::Views()
                           : seen->into(Eigen::AlignedBox3d(min - margin, max + margin));
    std::vector<Sums> sums(std::size_t{n} * n * n);
    const auto sumsAt = [&](int x, int y, int z) -> Sums& { return sums[indexInBlock({x, y, z})]; };
    graph.forEachVertexIn(min.cast<float>(), max.cast<float>(), [&](VertexId id) {
        const Vertex v = graph.vertex(id);
        const Eigen::Vector3d p = v.position.cast<double>();
        const Eigen::Vector3d inCells = p / cell_;
        const Eigen::Vector3i cell = wholesBelow(inCells);
        const Eigen::Vector3i at = cell - corner;
        if ((at.array() < 0).any() || (at.array() >= n).any()) {
            return;  // on the outer face: belongs to the next block
        }
        Sums& s = sumsAt(at.x(), at.y(), at.z());
        ++s.vertices;
        s.parts |= partBit(wholesBelow(kParts * inCells) - kParts * cell);
        s.position += p;
        s.normal += v.normal.cast<double>();
        if (v.open == 0) {
            return;
        }
        ++s.open;
        s.kinds |= v.open;
        s.openPosition += p;
        if ((v.open & ~kTooCoarse) != 0) {
            ++s.torn;
            const Eigen::Vector3d outward = outwardAt(graph, id, v, s);
            s.outward += outward;
            if (seen != nullptr) {
                if (const auto gap = gapAt(graph, views, v, outward, resolution_)) {
                    s.hidden += gap->width;
                    s.hiddenPosition += gap->place;
                    s.hiddenNormal += gap->normal;
                    ++s.hides;
                }
            }
            s.tornNormal += v.normal.cast<double>();
        } else {
            ++s.coarse;
            s.doubt += shareInDoubt(v.sigma, spacingAt(graph, id), resolution_);
            s.coarseNormal += v.normal.cast<double>();
        }
    });
    Block block;
    block.box = Eigen::AlignedBox3d(min, max);
    for (int z = 0; z < n; ++z) {
        for (int y = 0; y < n; ++y) {
            for (int x = 0; x < n; ++x) {
                const Sums& s = sumsAt(x, y, z);
                if (s.vertices > 0) {
                    block.cells.push_back(
                        toCell(s, pack(corner + Eigen::Vector3i(x, y, z)), cell_));
                }
            }
        }
    }
    if (!block.cells.empty()) {
        block.positions.resize(static_cast<Eigen::Index>(block.cells.size()), 3);
        for (std::size_t i = 0; i < block.cells.size(); ++i) {
            block.positions.row(static_cast<Eigen::Index>(i)) = block.cells[i].position.transpose();
        }
        block.parts.reserve(sums.size());
        for (const Sums& s : sums) {
            block.parts.push_back(s.vertices >= kLeastVertices ? s.parts : 0);
        }
        block.emptyAround = emptyAround(block.parts);
    }
    return block;
}

}  // namespace riftmap
