// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/graph/graph_storage.h"

#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <new>
#include <stdexcept>

namespace riftmap {

namespace {

constexpr PageBounds emptyBounds() {
    constexpr float kInf = std::numeric_limits<float>::infinity();
    return {{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}};
}

}  // namespace

GraphStorage::GraphStorage(double blockSize)
    : blockSize_(blockSize), levelScale_(static_cast<float>(kAcross / blockSize)) {}

GraphStorage::GraphStorage(const GraphStorage& other)
    : blockSize_(other.blockSize_),
      levelScale_(other.levelScale_),
      levels_(other.levels_),
      pageCount_(other.pageCount_),
      bounds_(other.bounds_),
      freePages_(other.freePages_),
      blocks_(other.blocks_),
      blockOfKey_(other.blockOfKey_),
      edgeChunkCount_(other.edgeChunkCount_),
      freeEdgeChunk_(other.freeEdgeChunk_),
      overhang_(other.overhang_),
      vertexCount_(other.vertexCount_),
      edgeCount_(other.edgeCount_) {
    for (std::uint32_t first = 0; first < pageCount_; first += kPagesPerChunk) {
        chunks_.push_back(newChunk(first > 0));
        std::uninitialized_copy_n(&other.page(first), std::min(kPagesPerChunk, pageCount_ - first),
                                  chunks_.back().get());
    }
    for (const auto& piece : other.edgePieces_) {
        edgePieces_.push_back(std::make_unique<EdgePiece>(*piece));
    }
}

std::size_t GraphStorage::KeyHash::operator()(const BlockKey& k) const {
    std::uint64_t h = 0;
    for (const std::int32_t v : k) {
        h = (h ^ static_cast<std::uint32_t>(v)) * 0x9E3779B97F4A7C15ULL;
        h ^= h >> 29U;
    }
    return h;
}

BlockKey GraphStorage::keyOf(const Eigen::Vector3f& p, std::int32_t level) const {
    const double edge = blockEdge(level);
    const auto cell = [edge](float v) {
        constexpr double kLimit = 2e9;
        return static_cast<std::int32_t>(
            std::clamp(std::floor(static_cast<double>(v) / edge), -kLimit, kLimit));
    };
    return {cell(p.x()), cell(p.y()), cell(p.z()), level};
}

GraphStorage::Cube GraphStorage::cubeOf(const Eigen::Vector3f& p, std::int32_t level) const {
    Cube cube;
    cube.key = keyOf(p, level);
    const double edge = blockEdge(level);
    const Eigen::Vector3d key(cube.key[0], cube.key[1], cube.key[2]);
    const Eigen::Vector3d rounding = 1e-12 * (key.cwiseAbs().array() + 1.0) * edge;
    cube.low = key * edge + rounding;
    cube.high = (key.array() + 1.0).matrix() * edge - rounding;
    return cube;
}

std::uint32_t GraphStorage::findBlock(const BlockKey& key) const {
    const auto it = blockOfKey_.find(key);
    return it == blockOfKey_.end() ? kNoBlock : it->second;
}

std::uint32_t GraphStorage::blockAt(const BlockKey& key) {
    const auto [it, fresh] = blockOfKey_.try_emplace(key, static_cast<std::uint32_t>(0));
    if (fresh) {
        it->second = static_cast<std::uint32_t>(blocks_.size());
        blocks_.emplace_back();
        blocks_.back().key = key;
        levels_ = std::max(levels_, key[3] + 1);
    }
    return it->second;
}

GraphStorage::PageChunk GraphStorage::newChunk(bool large) {
    PageChunk chunk(static_cast<Page*>(std::aligned_alloc(kChunkBytes, kChunkBytes)));
    if (!chunk) {
        throw std::bad_alloc();
    }
    if (large) {
        ::madvise(chunk.get(), kChunkBytes, MADV_HUGEPAGE);  // no harm where it is not possible
    }
    return chunk;
}

GraphStorage::PageChunk GraphStorage::takeChunk() {
    return nextChunk_ ? std::move(nextChunk_) : newChunk(!chunks_.empty());  // 2 MB are not little
}

/// The first touch of fresh memory costs more than filling it: up to 5 ms for a chunk where a
/// virtual machine has to be given it first.
void GraphStorage::prepareChunk() {
    constexpr std::size_t kSmallMap = 64;  // chunks, beside which another one is little
    if (nextChunk_ || chunks_.size() <= kSmallMap) {
        return;
    }
    nextChunk_ = newChunk(true);
    auto* bytes = reinterpret_cast<volatile char*>(nextChunk_.get());
    constexpr std::size_t kSystemPage = 4096;
    for (std::size_t i = 0; i < kChunkBytes; i += kSystemPage) {
        bytes[i] = 0;
    }
}

void GraphStorage::reservePages(std::uint32_t count) {
    while (pageCount_ < count) {
        if (pageCount_ % kPagesPerChunk == 0) {
            chunks_.push_back(takeChunk());
        }
        new (&page(pageCount_)) Page;
        ++pageCount_;
    }
    bounds_.resize(pageCount_, emptyBounds());
}

std::uint32_t GraphStorage::newPage(std::uint32_t block) {
    std::uint32_t index = pageCount_;
    if (freePages_.empty()) {
        constexpr std::uint32_t kMostPages = kNoVertex / Page::kSize;
        if (pageCount_ >= kMostPages) {
            throw std::length_error("pixel graph: more than 2^32 vertices");
        }
        reservePages(pageCount_ + 1);
    } else {
        std::pop_heap(freePages_.begin(), freePages_.end(), std::greater<>());
        index = freePages_.back();
        freePages_.pop_back();
    }
    page(index).block = block;
    blocks_[block].pages.push_back(index);
    return index;
}

void GraphStorage::addVertices(std::uint32_t block, std::uint32_t count,
                               std::vector<VertexId>& ids) {
    vertexCount_ += count;
    while (count > 0) {
        Block& b = blocks_[block];
        std::uint32_t index = kNoBlock;
        if (b.vertices < b.pages.size() * Page::kSize) {
            // The youngest page is the likeliest to have room.
            for (auto it = b.pages.rbegin(); index == kNoBlock && it != b.pages.rend(); ++it) {
                if (~page(*it).alive != 0) {
                    index = *it;
                }
            }
        }
        if (index == kNoBlock) {
            index = newPage(block);
        }
        Page& p = page(index);
        for (; count > 0 && ~p.alive != 0; --count) {
            const auto slot = static_cast<std::uint32_t>(std::countr_one(p.alive));
            p.alive |= std::uint64_t{1} << slot;
            ++blocks_[block].vertices;
            ids.push_back(idOf(index, slot));
        }
    }
}

VertexId GraphStorage::addVertex(std::uint32_t block) {
    std::vector<VertexId> ids;
    addVertices(block, 1, ids);
    page(pageOf(ids.front())).clearSlot(slotOf(ids.front()));
    return ids.front();
}

void GraphStorage::removeVertex(VertexId id) {
    std::vector<VertexId> neighbours;
    forEachHalfEdge(id, [&](VertexId n, std::uint16_t) { neighbours.push_back(n); });
    for (const VertexId n : neighbours) {
        removeEdge(id, n);
    }
    const std::uint32_t index = pageOf(id);
    Page& p = page(index);
    p.alive &= ~(std::uint64_t{1} << slotOf(id));
    Block& b = blocks_[p.block];
    --b.vertices;
    --vertexCount_;
    if (p.alive == 0) {
        b.pages.erase(std::find(b.pages.begin(), b.pages.end(), index));
        p.block = kNoBlock;
        freePages_.push_back(index);
        std::push_heap(freePages_.begin(), freePages_.end(), std::greater<>());
    }
}

void GraphStorage::updatePageBounds(std::uint32_t index) {
    const Page& p = page(index);
    PageBounds b = emptyBounds();
    forEachBit(p.alive, [&](std::uint32_t s) {
        b.min = {std::min(b.min[0], p.x[s]), std::min(b.min[1], p.y[s]),
                 std::min(b.min[2], p.z[s])};
        b.max = {std::max(b.max[0], p.x[s]), std::max(b.max[1], p.y[s]),
                 std::max(b.max[2], p.z[s])};
    });
    bounds_[index] = b;
}

void GraphStorage::updateBlockBounds(std::uint32_t block) {
    Block& b = blocks_[block];
    b.bounds = emptyBounds();
    for (const std::uint32_t index : b.pages) {
        for (std::size_t i = 0; i < 3; ++i) {
            b.bounds.min[i] = std::min(b.bounds.min[i], bounds_[index].min[i]);
            b.bounds.max[i] = std::max(b.bounds.max[i], bounds_[index].max[i]);
        }
    }
    for (std::size_t i = 0; i < 3 && !b.pages.empty(); ++i) {
        const double edge = blockEdge(b.key[3]), low = b.key[i] * edge, high = low + edge;
        overhang_ = std::max({overhang_, low - static_cast<double>(b.bounds.min[i]),
                              static_cast<double>(b.bounds.max[i]) - high});
    }
}

std::uint16_t* GraphStorage::findInChunks(std::uint32_t first, VertexId b) {
    for (std::uint32_t c = first; c != EdgeChunk::kNone; c = edgeChunk(c).next) {
        EdgeChunk& chunk = edgeChunk(c);
        for (std::uint32_t i = 0; i < EdgeChunk::kSize; ++i) {
            if (chunk.neighbour[i] == b) {
                return &chunk.weight[i];
            }
        }
    }
    return nullptr;
}

std::uint32_t GraphStorage::degree(VertexId id) const {
    const Page& p = page(pageOf(id));
    const auto& inlined = p.neighbour[slotOf(id)];
    if ((p.state[slotOf(id)] & kOverflow) == 0) {  // free slots come last
        return (inlined[0] != kNoVertex ? 1U : 0U) + (inlined[1] != kNoVertex ? 1U : 0U) +
               (inlined[2] != kNoVertex ? 1U : 0U) + (inlined[3] != kNoVertex ? 1U : 0U);
    }
    std::uint32_t n = 0;
    forEachHalfEdge(id, [&n](VertexId, std::uint16_t) { ++n; });
    return n;
}

void GraphStorage::appendInline(VertexId a, VertexId b, std::uint16_t weight) {
    Page& p = page(pageOf(a));
    const std::uint32_t slot = slotOf(a);
    std::uint32_t i = 0;
    while (p.neighbour[slot][i] != kNoVertex) {
        ++i;
    }
    p.neighbour[slot][i] = b;
    p.weight[slot][i] = weight;
}

std::uint32_t GraphStorage::newEdgeChunk() {
    std::uint32_t c = freeEdgeChunk_;
    if (c == EdgeChunk::kNone) {
        c = edgeChunkCount_++;
        if (c % kEdgeChunksPerPiece == 0) {
            edgePieces_.push_back(std::make_unique<EdgePiece>());
        }
    } else {
        freeEdgeChunk_ = edgeChunk(c).next;
    }
    edgeChunk(c).neighbour.fill(kNoVertex);
    edgeChunk(c).next = EdgeChunk::kNone;
    return c;
}

void GraphStorage::freeEdgeChunks(std::uint32_t first) {
    while (first != EdgeChunk::kNone) {
        const std::uint32_t next = edgeChunk(first).next;
        edgeChunk(first).next = freeEdgeChunk_;
        freeEdgeChunk_ = first;
        first = next;
    }
}

void GraphStorage::appendHalfEdge(VertexId a, VertexId b, std::uint16_t weight) {
    Page& p = page(pageOf(a));
    const std::uint32_t slot = slotOf(a);
    auto& neighbour = p.neighbour[slot];
    constexpr std::uint32_t kLast = Page::kInline - 1;
    if ((p.state[slot] & kOverflow) == 0) {
        if (neighbour[kLast] == kNoVertex) {
            appendInline(a, b, weight);
            return;
        }
        const std::uint32_t c = newEdgeChunk();
        edgeChunk(c).neighbour[0] = neighbour[kLast];
        edgeChunk(c).weight[0] = p.weight[slot][kLast];
        neighbour[kLast] = c;
        p.state[slot] |= kOverflow;
    }
    std::uint32_t c = neighbour[kLast];
    while (edgeChunk(c).next != EdgeChunk::kNone) {
        c = edgeChunk(c).next;
    }
    if (edgeChunk(c).neighbour[EdgeChunk::kSize - 1] != kNoVertex) {
        const std::uint32_t fresh = newEdgeChunk();
        edgeChunk(c).next = fresh;
        c = fresh;
    }
    std::uint32_t i = 0;
    while (edgeChunk(c).neighbour[i] != kNoVertex) {
        ++i;
    }
    edgeChunk(c).neighbour[i] = b;
    edgeChunk(c).weight[i] = weight;
}

void GraphStorage::addEdge(VertexId a, VertexId b, std::uint16_t weight) {
    appendHalfEdge(a, b, weight);
    appendHalfEdge(b, a, weight);
    ++edgeCount_;
}

bool GraphStorage::removeHalfEdge(VertexId a, VertexId b) {
    // Vertices have few edges: take them all out and put the others back.
    std::vector<std::pair<VertexId, std::uint16_t>> others;
    bool found = false;
    forEachHalfEdge(a, [&](VertexId n, std::uint16_t w) {
        if (n == b) {
            found = true;
        } else {
            others.emplace_back(n, w);
        }
    });
    if (found) {
        setHalfEdges(a, others);
    }
    return found;
}

void GraphStorage::setHalfEdges(VertexId a,
                                const std::vector<std::pair<VertexId, std::uint16_t>>& edges) {
    Page& p = page(pageOf(a));
    const std::uint32_t slot = slotOf(a);
    if ((p.state[slot] & kOverflow) != 0) {
        freeEdgeChunks(p.neighbour[slot][Page::kInline - 1]);
        p.state[slot] &= static_cast<std::uint8_t>(~kOverflow);
    }
    p.neighbour[slot].fill(kNoVertex);
    p.weight[slot].fill(0);
    for (const auto& [n, w] : edges) {
        appendHalfEdge(a, n, w);
    }
}

bool GraphStorage::removeEdge(VertexId a, VertexId b) {
    if (!removeHalfEdge(a, b)) {
        return false;
    }
    removeHalfEdge(b, a);
    --edgeCount_;
    return true;
}

std::size_t GraphStorage::memoryBytes() const {
    std::size_t bytes =
        // the first chunk is resident as far as it is used
        (chunks_.size() <= 1 ? pageCount_ * sizeof(Page) : chunks_.size() * kChunkBytes) +
        (nextChunk_ ? kChunkBytes : 0) + chunks_.capacity() * sizeof(chunks_[0]) +
        freePages_.capacity() * sizeof(std::uint32_t) + blocks_.capacity() * sizeof(Block) +
        edgePieces_.size() * sizeof(EdgePiece) +
        // a node and a bucket an entry, as libstdc++ has them
        blockOfKey_.size() * (sizeof(*blockOfKey_.begin()) + 2 * sizeof(void*)) +
        blockOfKey_.bucket_count() * sizeof(void*);
    for (const Block& b : blocks_) {
        bytes += b.pages.capacity() * sizeof(std::uint32_t);
    }
    return bytes;
}

std::size_t GraphStorage::rebuild() {
    freePages_.clear();
    vertexCount_ = 0;
    for (Block& b : blocks_) {
        b.vertices = 0;
    }
    std::size_t halfEdges = 0;
    std::vector<std::pair<VertexId, VertexId>> broken;
    for (std::uint32_t index = 0; index < pageCount_; ++index) {
        Page& p = page(index);
        if (p.alive == 0) {
            freePages_.push_back(index);
            continue;
        }
        updatePageBounds(index);
        const auto n = static_cast<std::uint32_t>(std::popcount(p.alive));
        blocks_[p.block].vertices += n;
        vertexCount_ += n;
        forEachBit(p.alive, [&](std::uint32_t slot) {
            const VertexId id = idOf(index, slot);
            forEachHalfEdge(id, [&](VertexId b, std::uint16_t) {
                if (alive(b)) {
                    ++halfEdges;
                } else {
                    broken.emplace_back(id, b);
                }
            });
        });
    }
    for (const auto& [a, b] : broken) {
        removeHalfEdge(a, b);
    }
    edgeCount_ = halfEdges / 2;
    for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
        updateBlockBounds(b);
    }
    return broken.size();
}

}  // namespace riftmap
