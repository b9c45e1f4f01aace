// SPDX-License-Identifier: BSD-3-Clause
// Where the vertices and edges lie: spatial blocks that own pages of 64 vertices. Part of the
// public headers only so that visitors inline; use it through PixelGraph.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "riftmap/graph/compact.h"

namespace riftmap {

/// Names a vertex of a PixelGraph; stays valid until that vertex is deleted.
using VertexId = std::uint32_t;
inline constexpr VertexId kNoVertex = 0xFFFFFFFFU;

/// Bits of a vertex that are not part of what a reader asks for.
enum VertexState : std::uint8_t {
    kSurrounded = 1,       ///< some view had all four pixel neighbours valid and near
    kFineEnough = 2,       ///< some view sampled it as densely as asked for
    kOverflow = 4,         ///< the last inline edge slot names an EdgeChunk
    kEvidenceShift = 3,    ///< 3 bits: how strongly views saw through it
    kEvidenceMask = 0x38,  ///<
};

/// Box of the map frame, borders included [m].
struct PageBounds {
    std::array<float, 3> min{}, max{};
    bool meets(const Eigen::Vector3f& low, const Eigen::Vector3f& high) const {
        return min[0] <= high.x() && max[0] >= low.x() && min[1] <= high.y() && max[1] >= low.y() &&
               min[2] <= high.z() && max[2] >= low.z();
    }
    /// Squared distance of a point, 0 inside.
    float squaredDistance(const Eigen::Vector3f& p) const {
        const float dx = std::max({0.0F, min[0] - p.x(), p.x() - max[0]});
        const float dy = std::max({0.0F, min[1] - p.y(), p.y() - max[1]});
        const float dz = std::max({0.0F, min[2] - p.z(), p.z() - max[2]});
        return dx * dx + dy * dy + dz * dz;
    }
};

/// 64 vertices of one block as arrays.
struct Page {  // NOLINT(cppcoreguidelines-pro-type-member-init): see below
    static constexpr std::uint32_t kSize = 64;
    static constexpr std::uint32_t kInline = 4;  ///< half-edges stored beside the vertex
    static constexpr std::uint64_t kHighBits = 0x0001000100010001ULL * compact::kHighBit;

    // Not set to anything: a page is first written to where a vertex is.
    std::array<float, kSize> x, y, z;         ///< map frame [m]
    std::array<std::uint32_t, kSize> normal;  ///< compact::encodeDirection
    std::array<std::uint16_t, kSize> sigma;   ///< compact::Sigma
    std::array<std::uint16_t, kSize> area;    ///< compact::Area
    std::array<std::array<std::uint8_t, 3>, kSize> rgb;
    std::array<std::uint8_t, kSize> open;   ///< OpenKind
    std::array<std::uint8_t, kSize> state;  ///< VertexState
    std::array<std::array<VertexId, kInline>, kSize> neighbour;
    std::array<std::array<std::uint16_t, kInline>, kSize> weight;

    std::uint64_t alive = 0;            ///< a bit a slot
    std::uint32_t block = 0xFFFFFFFFU;  ///< index of its block
    Eigen::Vector3f position(std::uint32_t slot) const { return {x[slot], y[slot], z[slot]}; }
    /// False if no edge of any vertex is high; true if one may be.
    bool mayHaveHighEdges() const {
        std::uint64_t codes = 0;
        unsigned states = 0;
        for (std::uint32_t slot = 0; slot < kSize; ++slot) {
            std::uint64_t four = 0;
            std::memcpy(&four, weight[slot].data(), sizeof(four));
            codes |= four;
            states |= state[slot];
        }
        return (codes & kHighBits) != 0 || (states & kOverflow) != 0;
    }
    /// Likewise for one vertex. Its free places have weight 0.
    bool mayHaveHighEdge(std::uint32_t slot) const {
        std::uint64_t codes = 0;
        std::memcpy(&codes, weight[slot].data(), sizeof(codes));
        return (codes & kHighBits) != 0 || (state[slot] & kOverflow) != 0;
    }
    bool living(std::uint32_t slot) const { return ((alive >> slot) & 1U) != 0; }
    /// Neither edges nor openness nor normal.
    void clearSlot(std::uint32_t slot) {
        normal[slot] = 0;
        open[slot] = 0;
        state[slot] = 0;
        neighbour[slot].fill(kNoVertex);
        weight[slot].fill(0);
    }
};

/// Names a cube of space: x, y, z = floor(position / edge), and the level; edge = blockSize
/// 2^level. Surface sampled coarsely, because it was seen from far, lies in larger cubes, so that a
/// block holds about as many vertices everywhere.
using BlockKey = std::array<std::int32_t, 4>;

/// A cube of space and the pages that hold its vertices.
struct Block {
    BlockKey key{};                    ///< of a vertex' position when it was made
    PageBounds bounds;                 ///< of its vertices; fusion may leave the cube
    std::vector<std::uint32_t> pages;  ///< ascending in age
    std::uint32_t vertices = 0;
};

/// Further half-edges of a vertex that has more than fit inline: few, because most such vertices
/// have five or six, and 16 bytes never cross a line of the cache.
struct EdgeChunk {
    static constexpr std::uint32_t kSize = 2;
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
    std::array<VertexId, kSize> neighbour{};
    std::array<std::uint16_t, kSize> weight{};
    std::uint32_t next = kNone;
};

/// Calls f(page index, slot) for each set bit of a page's mask.
template <class F>
void forEachBit(std::uint64_t mask, F&& f) {
    while (mask != 0) {
        f(static_cast<std::uint32_t>(std::countr_zero(mask)));
        mask &= mask - 1;
    }
}

/// Vertices, edges and the hash of blocks. Reading is thread-safe while nothing writes; methods
/// marked (parallel) may run at the same time on different vertices.
class GraphStorage {
 public:
    explicit GraphStorage(double blockSize);
    GraphStorage(const GraphStorage& other);
    GraphStorage& operator=(const GraphStorage&) = delete;
    ~GraphStorage() = default;

    static std::uint32_t pageOf(VertexId id) { return id / Page::kSize; }
    static std::uint32_t slotOf(VertexId id) { return id % Page::kSize; }
    static VertexId idOf(std::uint32_t page, std::uint32_t slot) {
        return page * Page::kSize + slot;
    }

    std::uint32_t pageCount() const { return pageCount_; }
    Page& page(std::uint32_t index) {
        return chunks_[index / kPagesPerChunk].get()[index % kPagesPerChunk];
    }
    const Page& page(std::uint32_t index) const {
        return chunks_[index / kPagesPerChunk].get()[index % kPagesPerChunk];
    }
    /// Asks for the lines that findHalfEdge(id, ...) will read.
    void prefetchEdges(VertexId id) const {
        const Page& p = page(pageOf(id));
        __builtin_prefetch(&p.neighbour[slotOf(id)]);
        __builtin_prefetch(&p.weight[slotOf(id)]);
    }
    const std::vector<Block>& blocks() const { return blocks_; }
    std::vector<Block>& blocks() { return blocks_; }
    double blockSize() const { return blockSize_; }

    bool alive(VertexId id) const {
        return pageOf(id) < pageCount_ && page(pageOf(id)).living(slotOf(id));
    }
    Eigen::Vector3f position(VertexId id) const { return page(pageOf(id)).position(slotOf(id)); }

    static constexpr std::int32_t kLevels = 12;
    /// The level whose blocks are at least kAcross vertices wide that lie `spacing` apart [m].
    std::int32_t levelOf(float spacing) const {
        const float ratio = spacing * levelScale_;
        if (!(ratio >= 1.0F)) {
            return 0;
        }
        const auto log2 = static_cast<std::int32_t>(std::bit_cast<std::uint32_t>(ratio) >> 23U);
        return std::min(kLevels - 1, log2 - 126);
    }
    BlockKey keyOf(const Eigen::Vector3f& p, std::int32_t level = 0) const;
    /// The cube of a block, to save keyOf() for points that surely lie inside.
    struct Cube {
        BlockKey key{};
        Eigen::Vector3d low, high;
        bool surelyHolds(const Eigen::Vector3f& p) const {
            const Eigen::Vector3d q = p.cast<double>();
            return (q.array() > low.array()).all() && (q.array() < high.array()).all();
        }
    };
    Cube cubeOf(const Eigen::Vector3f& p, std::int32_t level) const;
    /// Index of the block with this key; made if there is none.
    std::uint32_t blockAt(const BlockKey& key);
    /// Index of the block with this key, or kNoBlock.
    std::uint32_t findBlock(const BlockKey& key) const;
    static constexpr std::uint32_t kNoBlock = 0xFFFFFFFFU;

    /// A living vertex without edges; the caller fills the arrays. Reuses freed slots.
    VertexId addVertex(std::uint32_t block);
    /// Appends the ids of `count` living vertices; the caller clears their slots, too.
    void addVertices(std::uint32_t block, std::uint32_t count, std::vector<VertexId>& ids);
    /// Makes the next piece of memory ready that new vertices will ask for. Takes long: to be run
    /// beside what only reads vertices and writes to weights.
    void prepareChunk();
    /// Deletes a vertex with its edges.
    void removeVertex(VertexId id);
    /// Of the living vertices of a page. Apart from the pages, so that culling reads little.
    const PageBounds& bounds(std::uint32_t page) const { return bounds_[page]; }
    /// Recomputes the bounds of a page from its vertices (parallel).
    void updatePageBounds(std::uint32_t page);
    /// Recomputes the bounds of a block from those of its pages.
    void updateBlockBounds(std::uint32_t block);

    /// Where the weight code of edge a-b is stored at a; nullptr if there is none.
    std::uint16_t* findHalfEdge(VertexId a, VertexId b) {
        const HalfEdge found = lookUp(a, b);
        return found.there ? found.weight : nullptr;
    }
    /// The same for many edges one after the other: which edges there are cannot be foretold, so
    /// the usual way has no branch. `weight` may be read even if the edge is not there.
    struct HalfEdge {
        std::uint16_t* weight;
        bool there;
    };
    struct VertexEdges {
        VertexId* neighbour;
        std::uint16_t* weight;
        bool overflow;
    };
    VertexEdges edgesOf(VertexId a) {
        Page& p = page(pageOf(a));
        const std::uint32_t slot = slotOf(a);
        return {p.neighbour[slot].data(), p.weight[slot].data(), (p.state[slot] & kOverflow) != 0};
    }
    /// For kNoVertex the result says nothing.
    HalfEdge lookUp(const VertexEdges& a, VertexId b) {
        const VertexId* n = a.neighbour;
        const unsigned equal = (n[0] == b ? 1U : 0U) | (n[1] == b ? 2U : 0U) |
                               (n[2] == b ? 4U : 0U) | (n[3] == b ? 8U : 0U);
        if (a.overflow && (equal & 7U) == 0) {
            std::uint16_t* found = findInChunks(n[Page::kInline - 1], b);
            return {found != nullptr ? found : a.weight, found != nullptr};
        }
        return {&a.weight[static_cast<unsigned>(std::countr_zero(equal | 8U))], equal != 0};
    }
    HalfEdge lookUp(VertexId a, VertexId b) { return lookUp(edgesOf(a), b); }
    const std::uint16_t* findHalfEdge(VertexId a, VertexId b) const {
        return const_cast<GraphStorage*>(this)->findHalfEdge(a, b);
    }
    std::uint32_t degree(VertexId id) const;
    /// True from four edges on; quicker than counting them.
    bool fullInline(VertexId id) const {
        return page(pageOf(id)).neighbour[slotOf(id)][Page::kInline - 1] != kNoVertex;
    }
    /// Appends both half-edges; the edge must not exist.
    void addEdge(VertexId a, VertexId b, std::uint16_t weight);
    /// Replaces a's list of half-edges (for loading).
    void setHalfEdges(VertexId a, const std::vector<std::pair<VertexId, std::uint16_t>>& edges);
    /// False if there was none.
    bool removeEdge(VertexId a, VertexId b);

    /// Calls f(neighbour, weight code) for each edge of a vertex, in a fixed order.
    template <class F>
    void forEachHalfEdge(VertexId id, F&& f) const {
        const Page& p = page(pageOf(id));
        const std::uint32_t slot = slotOf(id);
        const auto& neighbour = p.neighbour[slot];
        const bool overflow = (p.state[slot] & kOverflow) != 0;
        const std::uint32_t inlined = Page::kInline - (overflow ? 1 : 0);
        for (std::uint32_t i = 0; i < inlined; ++i) {
            if (neighbour[i] == kNoVertex) {
                return;
            }
            f(neighbour[i], p.weight[slot][i]);
        }
        if (!overflow) {
            return;
        }
        for (std::uint32_t c = neighbour[Page::kInline - 1]; c != EdgeChunk::kNone;) {
            const EdgeChunk& chunk = edgeChunk(c);
            for (std::uint32_t i = 0; i < EdgeChunk::kSize; ++i) {
                if (chunk.neighbour[i] == kNoVertex) {
                    return;
                }
                f(chunk.neighbour[i], chunk.weight[i]);
            }
            c = chunk.next;
        }
    }
    /// Calls f(id) for each living vertex, ascending.
    template <class F>
    void forEachVertex(F&& f) const {
        for (std::uint32_t p = 0; p < pageCount_; ++p) {
            forEachBit(page(p).alive, [&](std::uint32_t slot) { f(idOf(p, slot)); });
        }
    }
    /// Calls f(block index) for each block whose bounds meet the box, in a fixed order: through the
    /// hash for a small box, over all blocks for a large one.
    template <class F>
    void forEachBlockIn(const Eigen::Vector3f& min, const Eigen::Vector3f& max, F&& f) const;

    std::size_t memoryBytes() const;
    std::size_t vertexCount() const { return vertexCount_; }
    std::size_t edgeCount() const { return edgeCount_; }
    /// Counts edges that were written to the pages of their new vertices.
    void countEdges(std::size_t added) { edgeCount_ += added; }

    /// For loading: makes pages up to this index exist, dead and without a block.
    void reservePages(std::uint32_t count);
    /// For loading: after pages were filled in, counts everything again and drops edges that lead
    /// to dead vertices. Returns the number of edges dropped.
    std::size_t rebuild();

 private:
    /// Pages are allocated by chunks as large as the pages of the processor's memory management
    /// can be: a view touches thousands of pages, and new memory comes in fewer, larger pieces.
    static constexpr std::size_t kChunkBytes = std::size_t{2} << 20U;
    static constexpr std::uint32_t kPagesPerChunk = kChunkBytes / sizeof(Page);
    struct FreeChunk {
        void operator()(Page* pages) const { std::free(pages); }
    };
    using PageChunk = std::unique_ptr<Page, FreeChunk>;
    static PageChunk newChunk(bool large);
    PageChunk takeChunk();

    struct KeyHash {
        std::size_t operator()(const BlockKey& k) const;
    };

    std::uint16_t* findInChunks(std::uint32_t first, VertexId b);
    void appendInline(VertexId a, VertexId b, std::uint16_t weight);
    void appendHalfEdge(VertexId a, VertexId b, std::uint16_t weight);
    bool removeHalfEdge(VertexId a, VertexId b);
    std::uint32_t newEdgeChunk();
    void freeEdgeChunks(std::uint32_t first);
    std::uint32_t newPage(std::uint32_t block);

    static constexpr double kAcross = 64;  ///< a surface then fills 64 pages
    double blockEdge(std::int32_t level) const {
        return blockSize_ * static_cast<double>(std::int32_t{1} << level);
    }

    double blockSize_;
    float levelScale_;               ///< levelOf()
    std::int32_t levels_ = 0;        ///< in use: above the highest
    std::vector<PageChunk> chunks_;  ///< kPagesPerChunk pages each
    PageChunk nextChunk_;            ///< prepareChunk()
    std::uint32_t pageCount_ = 0;
    std::vector<PageBounds> bounds_;        ///< of pages
    std::vector<std::uint32_t> freePages_;  ///< a heap, smallest on top: as after loading
    std::vector<Block> blocks_;
    std::unordered_map<BlockKey, std::uint32_t, KeyHash> blockOfKey_;
    /// In pieces: a vector that grows would hold up to twice of what it needs.
    static constexpr std::uint32_t kEdgeChunksPerPiece = 1024;
    using EdgePiece = std::array<EdgeChunk, kEdgeChunksPerPiece>;
    EdgeChunk& edgeChunk(std::uint32_t i) {
        return (*edgePieces_[i / kEdgeChunksPerPiece])[i % kEdgeChunksPerPiece];
    }
    const EdgeChunk& edgeChunk(std::uint32_t i) const {
        return (*edgePieces_[i / kEdgeChunksPerPiece])[i % kEdgeChunksPerPiece];
    }
    std::vector<std::unique_ptr<EdgePiece>> edgePieces_;
    std::uint32_t edgeChunkCount_ = 0;
    std::uint32_t freeEdgeChunk_ = EdgeChunk::kNone;
    double overhang_ = 0;  ///< how far vertices lie outside of their block's cube, at most [m]
    std::size_t vertexCount_ = 0, edgeCount_ = 0;
};

template <class F>
void GraphStorage::forEachBlockIn(const Eigen::Vector3f& min, const Eigen::Vector3f& max,
                                  F&& f) const {
    const auto visit = [&](std::uint32_t b) {
        if (blocks_[b].vertices > 0 && blocks_[b].bounds.meets(min, max)) {
            f(b);
        }
    };
    const Eigen::Vector3f reach = Eigen::Vector3f::Constant(static_cast<float>(overhang_));
    std::array<std::pair<BlockKey, BlockKey>, kLevels> cubes;
    double keys = 0;
    for (std::int32_t level = 0; level < levels_; ++level) {
        const auto low = keyOf(min - reach, level), high = keyOf(max + reach, level);
        cubes[static_cast<std::size_t>(level)] = {low, high};
        keys += (1.0 + high[0] - low[0]) * (1.0 + high[1] - low[1]) * (1.0 + high[2] - low[2]);
    }
    constexpr double kFewKeys = 64;
    if (!(keys <= kFewKeys) || keys > static_cast<double>(blocks_.size())) {
        for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
            visit(b);
        }
        return;
    }
    for (std::int32_t level = 0; level < levels_; ++level) {
        const auto& [low, high] = cubes[static_cast<std::size_t>(level)];
        for (std::int32_t x = low[0]; x <= high[0]; ++x) {
            for (std::int32_t y = low[1]; y <= high[1]; ++y) {
                for (std::int32_t z = low[2]; z <= high[2]; ++z) {
                    if (const std::uint32_t b = findBlock({x, y, z, level}); b != kNoBlock) {
                        visit(b);
                    }
                }
            }
        }
    }
}

}  // namespace riftmap
