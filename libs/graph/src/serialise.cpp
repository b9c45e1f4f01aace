// SPDX-License-Identifier: BSD-3-Clause
// The saved form of a graph; doc/file-formats.md describes it.

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <istream>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <type_traits>

#include "crc32.h"
#include "pixel_graph_impl.h"
#include "riftmap/core/parallel.h"

namespace riftmap {
namespace {

static_assert(std::endian::native == std::endian::little, "maps are saved little-endian");

constexpr std::array<char, 8> kMagic = {'R', 'I', 'F', 'T', 'G', 'R', 'P', 'H'};
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kPageBytes = offsetof(Page, alive);  // the arrays of a page
constexpr std::size_t kBlocksAtOnce = 64;

using Bytes = std::vector<char>;

template <class T>
void put(Bytes& out, const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::size_t at = out.size();
    out.resize(at + sizeof(T));
    std::memcpy(out.data() + at, &value, sizeof(T));
}

/// Reads values one after the other; throws std::runtime_error beyond the end.
class Reader {
 public:
    explicit Reader(const Bytes& bytes) : at_(bytes.data()), left_(bytes.size()) {}
    void bytes(void* to, std::size_t size) {
        if (size > left_) {
            throw std::runtime_error("is too short");
        }
        std::memcpy(to, at_, size);
        at_ += size;
        left_ -= size;
    }
    template <class T>
    T get() {
        T value{};
        bytes(&value, sizeof(T));
        return value;
    }
    std::size_t left() const { return left_; }

 private:
    const char* at_;
    std::size_t left_;
};

void write(std::ostream& out, const Bytes& bytes) {
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    const std::uint32_t crc = Crc32::of(bytes.data(), bytes.size());
    out.write(reinterpret_cast<const char*>(&crc), sizeof(crc));
}

enum class Damage { kNone, kChecksum, kEnd };

Damage read(std::istream& in, Bytes& bytes, std::uint64_t size) {
    // In steps, so that a wrong size ends at the end of the file and not of the memory.
    constexpr std::uint64_t kStep = std::uint64_t{1} << 24U;
    bytes.clear();
    while (bytes.size() < size) {
        const std::size_t before = bytes.size();
        bytes.resize(static_cast<std::size_t>(std::min<std::uint64_t>(size, before + kStep)));
        if (!in.read(bytes.data() + before, static_cast<std::streamsize>(bytes.size() - before))) {
            return Damage::kEnd;
        }
    }
    std::uint32_t crc = 0;
    if (!in.read(reinterpret_cast<char*>(&crc), sizeof(crc))) {
        return Damage::kEnd;
    }
    return crc == Crc32::of(bytes.data(), bytes.size()) ? Damage::kNone : Damage::kChecksum;
}

Bytes blockBytes(const GraphStorage& storage, const Block& block) {
    Bytes out;
    out.reserve(block.pages.size() * (kPageBytes + 16) + 64);
    put(out, block.key);
    put(out, static_cast<std::uint32_t>(block.pages.size()));
    Bytes overflow;
    std::uint32_t overflowing = 0;
    for (const std::uint32_t index : block.pages) {
        Page page = storage.page(index);
        for (std::uint32_t slot = 0; slot < Page::kSize; ++slot) {
            const bool alive = page.living(slot);
            if (alive && (page.state[slot] & kOverflow) != 0) {
                ++overflowing;
                const VertexId id = GraphStorage::idOf(index, slot);
                put(overflow, id);
                put(overflow, storage.degree(id));
                storage.forEachHalfEdge(id, [&](VertexId n, std::uint16_t w) {
                    put(overflow, n);
                    put(overflow, w);
                });
                page.state[slot] &= static_cast<std::uint8_t>(~kOverflow);
                page.neighbour[slot].fill(kNoVertex);
            }
            if (!alive) {  // whatever was there before: the same map gives the same bytes
                page.x[slot] = page.y[slot] = page.z[slot] = 0;
                page.normal[slot] = 0;
                page.sigma[slot] = page.area[slot] = 0;
                page.rgb[slot] = {};
                page.open[slot] = page.state[slot] = 0;
                page.neighbour[slot].fill(kNoVertex);
            }
            std::size_t used = 0;
            while (used < Page::kInline && page.neighbour[slot][used] != kNoVertex) {
                ++used;
            }
            std::fill(page.weight[slot].begin() + static_cast<std::ptrdiff_t>(used),
                      page.weight[slot].end(), std::uint16_t{0});
        }
        put(out, index);
        put(out, page.alive);
        const std::size_t at = out.size();
        out.resize(at + kPageBytes);
        std::memcpy(out.data() + at, page.x.data(), kPageBytes);
    }
    put(out, overflowing);
    out.insert(out.end(), overflow.begin(), overflow.end());
    return out;
}

/// `key`: of the block, as the directory has it. Throws std::runtime_error if the bytes contradict
/// it or themselves; the storage holds no part of the block then.
void restoreBlock(GraphStorage& storage, const BlockKey& key, const Bytes& bytes) {
    Reader in(bytes);
    if (!(in.get<BlockKey>() == key)) {
        throw std::runtime_error("calls itself another");
    }
    const std::uint32_t block = storage.blockAt(key);
    std::vector<std::uint32_t> pages;
    try {
        for (auto left = in.get<std::uint32_t>(); left > 0; --left) {
            const auto index = in.get<std::uint32_t>();
            if (index >= storage.pageCount() ||
                storage.page(index).block != GraphStorage::kNoBlock) {
                throw std::runtime_error("names a wrong page");
            }
            Page& page = storage.page(index);
            pages.push_back(index);
            page.block = block;
            page.alive = in.get<std::uint64_t>();
            in.bytes(page.x.data(), kPageBytes);
        }
        std::vector<std::pair<VertexId, std::uint16_t>> edges;
        for (auto left = in.get<std::uint32_t>(); left > 0; --left) {
            const auto id = in.get<VertexId>();
            const auto degree = in.get<std::uint32_t>();
            edges.clear();
            for (std::uint32_t e = 0; e < degree; ++e) {
                const auto n = in.get<VertexId>();
                edges.emplace_back(n, in.get<std::uint16_t>());
            }
            if (!storage.alive(id) || storage.page(GraphStorage::pageOf(id)).block != block) {
                throw std::runtime_error("names a wrong vertex");
            }
            storage.setHalfEdges(id, edges);
        }
    } catch (...) {
        for (const std::uint32_t index : pages) {
            storage.page(index) = Page{};
        }
        throw;
    }
    storage.blocks()[block].pages = std::move(pages);
}

std::string keyName(const BlockKey& key) {
    std::ostringstream s;
    s << '(' << key[0] << ", " << key[1] << ", " << key[2] << ')'
      << (key[3] > 0 ? " level " + std::to_string(key[3]) : "");
    return s.str();
}

}  // namespace

void PixelGraph::save(std::ostream& out) const {
    const GraphStorage& storage = impl_->storage;
    const std::vector<Rift>& rifts = this->rifts();
    const auto& blocks = storage.blocks();
    const GraphOptions& o = impl_->options;

    Bytes options;
    for (const double value :
         {o.targetResolution, o.delta, o.gamma, o.visibility, o.blockSize, o.riftExtent}) {
        put(options, value);
    }
    put(options, static_cast<std::uint8_t>(o.fusion));
    put(options, static_cast<std::uint8_t>(o.typedOpenness));

    // The directory first: with the size of every block one damaged block is stepped over.
    Bytes directory;
    put(directory, storage.pageCount());
    put(directory, static_cast<std::uint64_t>(impl_->rawPoints));
    put(directory, static_cast<std::uint32_t>(blocks.size()));
    std::vector<std::uint64_t> sizes(blocks.size());
    parallelFor(blocks.size(), 1, [&](std::size_t b, std::size_t) {
        sizes[b] = 24 + blocks[b].pages.size() * (kPageBytes + 12);
        for (const std::uint32_t index : blocks[b].pages) {
            const Page& page = storage.page(index);
            forEachBit(page.alive, [&](std::uint32_t slot) {
                if ((page.state[slot] & kOverflow) != 0) {
                    sizes[b] += 8 + 6 * storage.degree(GraphStorage::idOf(index, slot));
                }
            });
        }
    });
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        put(directory, blocks[b].key);
        put(directory, sizes[b]);
    }
    Bytes tears;
    put(tears, impl_->rifts.nextId());
    put(tears, static_cast<std::uint32_t>(rifts.size()));
    for (const Rift& rift : rifts) {
        put(tears, rift.id);
        put(tears, rift.centre.x());
        put(tears, rift.centre.y());
        put(tears, rift.centre.z());
        put(tears, static_cast<std::uint32_t>(rift.vertices.size()));
        for (const VertexId id : rift.vertices) {
            put(tears, id);
        }
    }

    Bytes head(kMagic.begin(), kMagic.end());
    put(head, kVersion);
    put(head, static_cast<std::uint32_t>(options.size()));
    put(head, static_cast<std::uint64_t>(directory.size()));
    put(head, static_cast<std::uint64_t>(tears.size()));
    write(out, head);
    write(out, options);
    write(out, directory);
    for (std::size_t first = 0; first < blocks.size(); first += kBlocksAtOnce) {
        const std::size_t n = std::min(kBlocksAtOnce, blocks.size() - first);
        std::vector<Bytes> batch(n);
        parallelFor(n, 1, [&](std::size_t i, std::size_t) {
            batch[i] = blockBytes(storage, blocks[first + i]);
            put(batch[i], Crc32::of(batch[i].data(), batch[i].size()));
        });
        for (const Bytes& bytes : batch) {
            out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        }
    }
    write(out, tears);
    if (!out) {
        throw std::runtime_error("pixel graph: writing failed");
    }
}

void PixelGraph::load(std::istream& in) {
    const auto fail = [](const std::string& what) {
        throw std::runtime_error("pixel graph: " + what);
    };
    Bytes bytes;
    constexpr std::size_t kHeadBytes = kMagic.size() + 24;
    const Damage head = read(in, bytes, kHeadBytes);
    if (bytes.size() < kMagic.size() || head == Damage::kEnd ||
        !std::equal(kMagic.begin(), kMagic.end(), bytes.begin())) {
        fail("this is no saved pixel graph");
    }
    if (head != Damage::kNone) {
        fail("the head is damaged (checksum)");
    }
    Reader sizes(bytes);
    sizes.get<std::array<char, 8>>();
    const auto version = sizes.get<std::uint32_t>();
    if (version != kVersion) {
        fail("version " + std::to_string(version) + ", allowed: " + std::to_string(kVersion));
    }
    const auto optionBytes = sizes.get<std::uint32_t>();
    const auto directoryBytes = sizes.get<std::uint64_t>();
    const auto tearBytes = sizes.get<std::uint64_t>();
    if (read(in, bytes, optionBytes) != Damage::kNone) {
        fail("the options are damaged");
    }
    Reader o(bytes);
    GraphOptions options;
    for (double* value : {&options.targetResolution, &options.delta, &options.gamma,
                          &options.visibility, &options.blockSize, &options.riftExtent}) {
        *value = o.get<double>();
    }
    options.fusion = static_cast<GraphOptions::Fusion>(o.get<std::uint8_t>());
    options.typedOpenness = o.get<std::uint8_t>() != 0;
    Bytes directory;
    if (read(in, directory, directoryBytes) != Damage::kNone) {
        fail("the directory of blocks is damaged");
    }

    auto fresh = std::make_unique<Impl>(options);
    Reader entries(directory);
    fresh->storage.reservePages(entries.get<std::uint32_t>());
    fresh->rawPoints = static_cast<std::size_t>(entries.get<std::uint64_t>());
    std::string damage;
    const auto note = [&damage](const std::string& what) {
        damage += (damage.empty() ? "" : "; ") + what;
    };
    const auto blockCount = entries.get<std::uint32_t>();
    std::vector<BlockKey> keys(blockCount);
    std::vector<std::uint64_t> lengths(blockCount);
    for (std::uint32_t b = 0; b < blockCount; ++b) {
        keys[b] = entries.get<BlockKey>();
        lengths[b] = entries.get<std::uint64_t>();
        if (keys[b][3] < 0 || keys[b][3] >= GraphStorage::kLevels) {
            fail("the directory of blocks is damaged");
        }
        fresh->storage.blockAt(keys[b]);  // the same index as before
    }
    for (std::uint32_t b = 0; b < blockCount; ++b) {
        const Damage found = read(in, bytes, lengths[b]);
        if (found == Damage::kEnd) {
            note("the file ends in block " + std::to_string(b) + " " + keyName(keys[b]) + " of " +
                 std::to_string(blockCount));
            break;
        }
        try {
            if (found == Damage::kChecksum) {
                throw std::runtime_error("has a wrong checksum");
            }
            restoreBlock(fresh->storage, keys[b], bytes);
        } catch (const std::runtime_error& e) {
            note("block " + std::to_string(b) + " " + keyName(keys[b]) + " " + e.what());
        }
    }
    fresh->storage.rebuild();
    fresh->storage.forEachVertex([&](VertexId id) {
        fresh->area += compact::areaUnits(
            fresh->storage.page(GraphStorage::pageOf(id)).area[GraphStorage::slotOf(id)]);
    });

    std::vector<Rift> rifts;
    std::uint32_t nextId = 0;
    if (in && read(in, bytes, tearBytes) == Damage::kNone) {
        Reader r(bytes);
        nextId = r.get<std::uint32_t>();
        rifts.resize(r.get<std::uint32_t>());
        for (Rift& rift : rifts) {
            rift.id = r.get<std::uint32_t>();
            for (Eigen::Index i = 0; i < 3; ++i) {
                rift.centre[i] = r.get<float>();
            }
            rift.vertices.resize(r.get<std::uint32_t>());
            r.bytes(rift.vertices.data(), rift.vertices.size() * sizeof(VertexId));
        }
    } else {
        note("the names of the rifts are damaged: rifts are numbered anew");
    }
    fresh->rifts.restore(fresh->storage, std::move(rifts), nextId);
    impl_ = std::move(fresh);
    if (!damage.empty()) {
        throw DamagedMapError("pixel graph: " + damage + "; everything else was loaded");
    }
}

}  // namespace riftmap
