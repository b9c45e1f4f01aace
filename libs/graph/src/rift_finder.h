// SPDX-License-Identifier: BSD-3-Clause
// Algorithm 1 of the paper, kept up to date cell by cell.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "riftmap/graph/graph_storage.h"
#include "riftmap/graph/pixel_graph.h"

namespace riftmap {

/// Rifts of a graph. Members are the open vertices, or with `typedOpenness` off the ends of high
/// edges. Two members belong together where an edge joins them or, among open vertices, where they
/// share a neighbour (the rim of a tear is often connected diagonally only). Space is divided into
/// cells of `riftExtent`; what lies in another cell does not count, so a cell's rifts depend on
/// nothing outside of it. Not thread-safe.
class RiftFinder {
 public:
    explicit RiftFinder(const GraphOptions& options);

    /// Something about a vertex or an edge of this block changed.
    void touch(std::uint32_t block);
    /// Works the cells of touched blocks again; the others keep their rifts.
    const std::vector<Rift>& update(const GraphStorage& storage);
    /// As if everything was touched, with the ids of these rifts to follow (for loading).
    void restore(const GraphStorage& storage, std::vector<Rift> rifts, std::uint32_t nextId);

    const std::vector<Rift>& rifts() const { return rifts_; }
    std::uint32_t nextId() const { return nextId_; }
    std::size_t memoryBytes() const;

 private:
    struct Cell {
        std::array<std::int32_t, 3> key{};
        std::vector<std::uint32_t> blocks;  ///< ascending
        std::vector<std::uint32_t> rifts;   ///< ids
        bool touched = false;
    };

    std::uint32_t cellOf(const GraphStorage& storage, std::uint32_t block);
    void addBlocks(const GraphStorage& storage);
    std::vector<Rift> find(const GraphStorage& storage, std::uint32_t cell);
    void nameRifts(std::uint32_t cell, std::vector<Rift>& fresh);
    const Rift& byId(std::uint32_t id) const;

    GraphOptions options_;
    std::int32_t blocksPerCell_;  ///< along an axis; 0 = one cell for everything
    std::vector<Cell> cells_;
    std::unordered_map<std::uint64_t, std::uint32_t> cellOfKey_;
    std::vector<std::uint32_t> cellOfBlock_;
    std::vector<std::uint32_t> touched_;  ///< blocks
    std::vector<std::uint64_t> members_;  ///< page -> slots that are members
    std::vector<std::uint32_t> base_;     ///< page -> number of its first member within the cell
    std::vector<Rift> rifts_;             ///< ascending in id
    std::uint32_t nextId_ = 0;
};

}  // namespace riftmap
