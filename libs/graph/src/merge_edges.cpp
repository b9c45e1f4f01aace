// SPDX-License-Identifier: BSD-3-Clause
// The edges of a view become edges of the map.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <iterator>
#include <utility>

#include "edge_kernel.h"
#include "merge.h"
#include "merge_codes.h"

namespace riftmap {
namespace {

constexpr std::uint32_t kWellConnected = Page::kInline;  // edges of a pixel
constexpr std::uint32_t kMostEdges = 9;                  // of a vertex, but in paper mode
constexpr int kRowsAtOnce = 8;

}  // namespace

void Merger::connectNew(GraphStorage& storage, MergeResult& result) {
    // Each new vertex is one pixel and writes its own half-edges to other new ones.
    std::atomic<std::size_t> added{0};
    const auto w = static_cast<std::size_t>(points_.width);
    forEach(fresh_.size(), 1024, [&](std::size_t f) {
        const std::size_t i = fresh_[f];
        const VertexId id = vertexOf_[i];
        const auto connect = [&](std::size_t j, std::uint16_t code) {
            if (code != ViewPoints::kNoEdge && isFresh_[j] != 0) {
                storage.appendInline(id, vertexOf_[j], code);
                return true;
            }
            return false;
        };
        std::size_t mine = 0;
        mine += connect(i + 1, points_.right[i]) ? 1U : 0U;
        mine += connect(i + w, points_.down[i]) ? 1U : 0U;
        if (i % w > 0) {
            connect(i - 1, points_.right[i - 1]);
        }
        if (i >= w) {
            connect(i - w, points_.down[i - w]);
        }
        added.fetch_add(mine, std::memory_order_relaxed);
    });
    storage.countEdges(added.load());
    result.newEdges += added.load();
}

bool Merger::wanted(const GraphStorage& storage, const NewEdge& e) const {
    if (paper()) {
        return true;
    }
    // Between two vertices that have their four neighbours each, a further low edge says nothing.
    const bool high = (e.code & compact::kHighBit) != 0;
    if (!high && storage.fullInline(e.a) && storage.fullInline(e.b)) {
        return false;
    }
    const std::uint32_t da = storage.degree(e.a), db = storage.degree(e.b);
    if (da >= kMostEdges || db >= kMostEdges) {
        return false;
    }
    return high || da < kWellConnected || db < kWellConnected;
}

/// Edges of the view between vertices that are not both new: lowers the weights of those that the
/// map has, lists those it lacks. What becomes of an edge cannot be foretold, so each step passes
/// on those that are left to the next: there are no branches to guess wrong.
void Merger::compareEdges(GraphStorage& storage, int strip) {
    thread_local EdgeScratch lists;
    const int first = strip * kRowsAtOnce, end = std::min(points_.height, first + kRowsAtOnce);
    const auto w = static_cast<std::size_t>(points_.width);
    const std::size_t line = points_.index(0, first);
    const std::size_t pixels = w * static_cast<std::size_t>(end - first);
    lists.resize(2 * pixels + 2 * kEdgePadding);
    VertexId *a = lists.a.data(), *b = lists.b.data();
    std::uint32_t* code = lists.code.data();
    std::size_t count = 0;
    for (const auto& [codes, ahead] :
         {std::pair{points_.right.data(), std::size_t{1}}, std::pair{points_.down.data(), w}}) {
        count += listEdges({&vertexOf_[line], &isFresh_[line], codes + line, pixels, ahead},
                           a + count, b + count, code + count);
    }
    NewEdge* missing = lists.missing.data();
    EdgeScratch::Lower* lower = lists.lower.data();
    for (std::size_t e = 0; e < count; ++e) {
        constexpr std::size_t kAhead = 16;
        storage.prefetchEdges(a[std::min(e + kAhead, count - 1)]);
        const GraphStorage::HalfEdge found = storage.lookUp(a[e], b[e]);
        const auto seen = static_cast<std::uint16_t>(code[e]);
        const std::uint16_t old = weightAt(*found.weight);
        *lower = {found.weight, a[e], b[e], seen};
        lower += static_cast<unsigned>(found.there) &
                 static_cast<unsigned>(compact::smallerWeight(old, seen) != old);
        *missing = {a[e], b[e], seen};
        missing += static_cast<unsigned>(!found.there);
    }
    for (const auto* l = lists.lower.data(); l != lower; ++l) {
        if (lowerWeight(*l->there, l->code)) {
            lowerWeight(*storage.findHalfEdge(l->b, l->a), l->code);
        }
    }
    auto& result = missingEdges_[static_cast<std::size_t>(strip)];
    result.clear();
    std::copy_if(lists.missing.data(), missing, std::back_inserter(result),
                 [&](const NewEdge& e) { return wanted(storage, e); });
}

void Merger::connectMatched(GraphStorage& storage, MergeResult& result) {
    missingEdges_.resize((static_cast<std::size_t>(points_.height) + kRowsAtOnce - 1) /
                         kRowsAtOnce);
    forEach(missingEdges_.size(), 1,
            [&](std::size_t strip) { compareEdges(storage, static_cast<int>(strip)); });
    for (const auto& strip : missingEdges_) {
        for (const NewEdge& e : strip) {
            if (std::uint16_t* there = storage.findHalfEdge(e.a, e.b)) {
                lowerWeight(*there, e.code);
                lowerWeight(*storage.findHalfEdge(e.b, e.a), e.code);
            } else if (wanted(storage, e)) {
                storage.addEdge(e.a, e.b, e.code);
                ++result.newEdges;
            }
        }
    }
}

}  // namespace riftmap
