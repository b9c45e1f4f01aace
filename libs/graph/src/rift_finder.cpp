// SPDX-License-Identifier: BSD-3-Clause
#include "rift_finder.h"

#include <algorithm>
#include <cmath>

#include "riftmap/core/parallel.h"
#include "riftmap/core/union_find.h"

namespace riftmap {
namespace {

bool hasHighEdge(const GraphStorage& storage, VertexId id) {
    bool high = false;
    storage.forEachHalfEdge(
        id, [&](VertexId, std::uint16_t w) { high = high || (w & compact::kHighBit) != 0; });
    return high;
}

std::int32_t floorDivide(std::int64_t a, std::int32_t b) {
    return static_cast<std::int32_t>(a >= 0 ? a / b : -((-a + b - 1) / b));
}

}  // namespace

RiftFinder::RiftFinder(const GraphOptions& options)
    : options_(options),
      blocksPerCell_(
          options.riftExtent > 0
              ? std::max(1, static_cast<int>(std::lround(options.riftExtent / options.blockSize)))
              : 0) {}

void RiftFinder::touch(std::uint32_t block) {
    touched_.push_back(block);
}

std::uint32_t RiftFinder::cellOf(const GraphStorage& storage, std::uint32_t block) {
    std::array<std::int32_t, 3> key{};
    std::uint64_t hash = 0;
    for (std::size_t i = 0; blocksPerCell_ > 0 && i < 3; ++i) {
        // A block that is larger than a cell belongs to that of its lowest corner.
        const BlockKey& of = storage.blocks()[block].key;
        key[i] = floorDivide(std::int64_t{of[i]} << of[3], blocksPerCell_);
        hash = (hash << 21U) ^ (static_cast<std::uint32_t>(key[i]) & 0x1FFFFFU);
    }
    // Keys beyond 2^20 cells would share a hash: chain on to the next free number.
    for (;; ++hash) {
        const auto [it, fresh] =
            cellOfKey_.try_emplace(hash, static_cast<std::uint32_t>(cells_.size()));
        if (fresh) {
            cells_.emplace_back();
            cells_.back().key = key;
        }
        if (cells_[it->second].key == key) {
            return it->second;
        }
    }
}

void RiftFinder::addBlocks(const GraphStorage& storage) {
    while (cellOfBlock_.size() < storage.blocks().size()) {
        const auto block = static_cast<std::uint32_t>(cellOfBlock_.size());
        cellOfBlock_.push_back(cellOf(storage, block));
        cells_[cellOfBlock_.back()].blocks.push_back(block);
    }
    members_.resize(storage.pageCount());
    base_.resize(storage.pageCount());
}

const Rift& RiftFinder::byId(std::uint32_t id) const {
    return *std::lower_bound(rifts_.begin(), rifts_.end(), id,
                             [](const Rift& r, std::uint32_t key) { return r.id < key; });
}

std::vector<Rift> RiftFinder::find(const GraphStorage& storage, std::uint32_t cell) {
    // Members, numbered through the pages of the cell.
    std::vector<VertexId> members;
    for (const std::uint32_t block : cells_[cell].blocks) {
        for (const std::uint32_t index : storage.blocks()[block].pages) {
            const Page& page = storage.page(index);
            base_[index] = static_cast<std::uint32_t>(members.size());
            std::uint64_t mask = 0;
            forEachBit(page.alive, [&](std::uint32_t slot) {
                const VertexId id = GraphStorage::idOf(index, slot);
                if (options_.typedOpenness ? page.open[slot] != 0 : hasHighEdge(storage, id)) {
                    mask |= std::uint64_t{1} << slot;
                    members.push_back(id);
                }
            });
            members_[index] = mask;
        }
    }
    constexpr std::uint32_t kNotMember = 0xFFFFFFFFU;
    const auto inCell = [&](VertexId id) {
        return cellOfBlock_[storage.page(GraphStorage::pageOf(id)).block] == cell;
    };
    const auto numberOf = [&](VertexId id) {  // of a vertex in this cell
        const std::uint32_t index = GraphStorage::pageOf(id);
        const std::uint64_t bit = std::uint64_t{1} << GraphStorage::slotOf(id);
        return (members_[index] & bit) == 0
                   ? kNotMember
                   : base_[index] +
                         static_cast<std::uint32_t>(std::popcount(members_[index] & (bit - 1)));
    };

    UnionFind sets(members.size());
    for (std::uint32_t i = 0; i < members.size(); ++i) {
        const auto join = [&](VertexId other) {
            const std::uint32_t j = numberOf(other);
            if (j != kNotMember && j != i) {
                sets.unite(i, j);
            }
        };
        storage.forEachHalfEdge(members[i], [&](VertexId n, std::uint16_t) {
            if (!inCell(n)) {
                return;
            }
            join(n);
            if (options_.typedOpenness) {
                storage.forEachHalfEdge(n, [&](VertexId m, std::uint16_t) {
                    if (inCell(m)) {
                        join(m);
                    }
                });
            }
        });
    }

    std::vector<std::uint32_t> riftOf(members.size());
    std::vector<Rift> rifts;
    for (std::uint32_t i = 0; i < members.size(); ++i) {
        const std::uint32_t root = sets.root(i);
        if (root == i) {
            riftOf[i] = static_cast<std::uint32_t>(rifts.size());
            rifts.emplace_back();
        }
        riftOf[i] = riftOf[root];
        rifts[riftOf[i]].vertices.push_back(members[i]);
    }
    for (std::uint32_t r = 0; r < rifts.size(); ++r) {
        Rift& rift = rifts[r];
        rift.vertices.shrink_to_fit();  // kept for as long as its cell is at rest
        std::sort(rift.vertices.begin(), rift.vertices.end());
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();
        Eigen::Vector3d normal = Eigen::Vector3d::Zero();
        for (const VertexId id : rift.vertices) {
            const Page& page = storage.page(GraphStorage::pageOf(id));
            const std::uint32_t slot = GraphStorage::slotOf(id);
            centre += page.position(slot).cast<double>();
            normal += compact::decodeDirection(page.normal[slot]).cast<double>();
            rift.kinds |= page.open[slot];
            storage.forEachHalfEdge(id, [&](VertexId n, std::uint16_t w) {
                if ((w & compact::kHighBit) == 0) {
                    return;
                }
                const std::uint32_t j = inCell(n) ? numberOf(n) : kNotMember;
                const bool both = j != kNotMember && riftOf[j] == r;
                rift.highEdges += !both || id < n ? 1 : 0;
            });
        }
        rift.centre = (centre / static_cast<double>(rift.vertices.size())).cast<float>();
        if (normal.norm() > 1e-6) {
            rift.normal = normal.normalized().cast<float>();
        }
    }
    std::sort(rifts.begin(), rifts.end(),
              [](const Rift& a, const Rift& b) { return a.vertices.front() < b.vertices.front(); });
    return rifts;
}

void RiftFinder::nameRifts(std::uint32_t cell, std::vector<Rift>& fresh) {
    constexpr std::uint32_t kUnnamed = 0xFFFFFFFFU;
    std::vector<const Rift*> old;
    std::vector<std::pair<VertexId, std::uint32_t>> oldOf;
    for (const std::uint32_t id : cells_[cell].rifts) {
        old.push_back(&byId(id));
        for (const VertexId v : old.back()->vertices) {
            oldOf.emplace_back(v, static_cast<std::uint32_t>(old.size() - 1));
        }
    }
    std::sort(oldOf.begin(), oldOf.end());
    for (Rift& rift : fresh) {
        rift.id = kUnnamed;
    }
    struct Claim {
        double worth;
        std::uint32_t old, fresh;
    };
    std::vector<bool> taken(old.size(), false);
    const auto settle = [&](std::vector<Claim>& claims) {
        std::sort(claims.begin(), claims.end(), [](const Claim& a, const Claim& b) {
            return a.worth != b.worth ? a.worth > b.worth
                                      : (a.old != b.old ? a.old < b.old : a.fresh < b.fresh);
        });
        for (const Claim& c : claims) {
            if (!taken[c.old] && fresh[c.fresh].id == kUnnamed) {
                taken[c.old] = true;
                fresh[c.fresh].id = old[c.old]->id;
            }
        }
    };
    // First whoever shares most vertices, then whoever lies near.
    std::vector<Claim> claims;
    std::vector<std::uint32_t> shared(old.size());
    for (std::uint32_t f = 0; f < fresh.size(); ++f) {
        std::fill(shared.begin(), shared.end(), 0U);
        for (const VertexId v : fresh[f].vertices) {
            const auto it = std::lower_bound(oldOf.begin(), oldOf.end(), std::make_pair(v, 0U));
            if (it != oldOf.end() && it->first == v) {
                ++shared[it->second];
            }
        }
        for (std::uint32_t o = 0; o < old.size(); ++o) {
            if (shared[o] > 0) {
                claims.push_back({static_cast<double>(shared[o]), o, f});
            }
        }
    }
    settle(claims);
    claims.clear();
    const auto near = static_cast<float>(options_.blockSize / 2);
    for (std::uint32_t f = 0; f < fresh.size(); ++f) {
        for (std::uint32_t o = 0; fresh[f].id == kUnnamed && o < old.size(); ++o) {
            const float distance = (fresh[f].centre - old[o]->centre).norm();
            if (!taken[o] && distance < near) {
                claims.push_back({-static_cast<double>(distance), o, f});
            }
        }
    }
    settle(claims);
    for (Rift& rift : fresh) {
        if (rift.id == kUnnamed) {
            rift.id = nextId_++;
        }
    }
}

const std::vector<Rift>& RiftFinder::update(const GraphStorage& storage) {
    if (touched_.empty()) {
        return rifts_;
    }
    addBlocks(storage);
    std::vector<std::uint32_t> work;
    for (const std::uint32_t block : touched_) {
        Cell& cell = cells_[cellOfBlock_[block]];
        if (!cell.touched) {
            cell.touched = true;
            work.push_back(cellOfBlock_[block]);
        }
    }
    touched_.clear();
    std::sort(work.begin(), work.end());
    std::vector<std::vector<Rift>> found(work.size());
    parallelFor(work.size(), 1,
                [&](std::size_t i, std::size_t) { found[i] = find(storage, work[i]); });
    std::vector<std::uint32_t> gone;
    for (std::size_t i = 0; i < work.size(); ++i) {
        Cell& cell = cells_[work[i]];
        nameRifts(work[i], found[i]);
        gone.insert(gone.end(), cell.rifts.begin(), cell.rifts.end());
        cell.rifts.clear();
        for (const Rift& rift : found[i]) {
            cell.rifts.push_back(rift.id);
        }
        std::sort(cell.rifts.begin(), cell.rifts.end());
        cell.touched = false;
    }
    std::sort(gone.begin(), gone.end());
    std::erase_if(rifts_, [&](const Rift& rift) {
        return std::binary_search(gone.begin(), gone.end(), rift.id);
    });
    for (auto& fresh : found) {
        std::move(fresh.begin(), fresh.end(), std::back_inserter(rifts_));
    }
    std::sort(rifts_.begin(), rifts_.end(),
              [](const Rift& a, const Rift& b) { return a.id < b.id; });
    return rifts_;
}

void RiftFinder::restore(const GraphStorage& storage, std::vector<Rift> rifts,
                         std::uint32_t nextId) {
    *this = RiftFinder(options_);
    addBlocks(storage);
    rifts_ = std::move(rifts);
    nextId_ = nextId;
    std::erase_if(rifts_, [&](Rift& rift) {
        std::erase_if(rift.vertices, [&](VertexId id) { return !storage.alive(id); });
        if (rift.vertices.empty()) {
            return true;
        }
        const std::uint32_t index = GraphStorage::pageOf(rift.vertices.front());
        cells_[cellOfBlock_[storage.page(index).block]].rifts.push_back(rift.id);
        return false;
    });
    for (std::uint32_t b = 0; b < storage.blocks().size(); ++b) {
        touch(b);
    }
}

std::size_t RiftFinder::memoryBytes() const {
    std::size_t bytes = members_.capacity() * sizeof(members_[0]) +
                        base_.capacity() * sizeof(base_[0]) +
                        cellOfBlock_.capacity() * sizeof(cellOfBlock_[0]) +
                        cells_.capacity() * sizeof(Cell) + rifts_.capacity() * sizeof(Rift);
    for (const Cell& cell : cells_) {
        bytes += cell.blocks.capacity() * sizeof(cell.blocks[0]) +
                 cell.rifts.capacity() * sizeof(cell.rifts[0]);
    }
    for (const Rift& rift : rifts_) {
        bytes += rift.vertices.capacity() * sizeof(VertexId);
    }
    return bytes;
}

}  // namespace riftmap
