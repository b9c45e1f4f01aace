// SPDX-License-Identifier: BSD-3-Clause
// The edges of a view become edges of the map.
#include <algorithm>
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
    lists.resize(pixels + kEdgePadding);
    const EdgeList list{lists.from.data(), lists.right.data(), lists.down.data(),
                        lists.codes.data()};
    const std::size_t count = listEdges(
        {&vertexOf_[line], &isFresh_[line], &points_.right[line], &points_.down[line], pixels, w},
        list);
    NewEdge* missing = lists.missing.data();
    EdgeScratch::Lower* lower = lists.lower.data();
    for (std::size_t k = 0; k < count; ++k) {
        constexpr std::size_t kAhead = 12;
        storage.prefetchEdges(list.from[std::min(k + kAhead, count - 1)]);
        const VertexId a = list.from[k];
        const GraphStorage::VertexEdges edges = storage.edgesOf(a);
        const auto compare = [&](VertexId b, std::uint16_t seen) {
            const GraphStorage::HalfEdge found = storage.lookUp(edges, b);
            const std::uint16_t old = weightAt(*found.weight);
            const bool concerned = b != kNoVertex;
            const bool lowers = compact::smallerWeight(old, seen) != old;
            *lower = {found.weight, a, b, seen};
            lower += static_cast<unsigned>(concerned) & static_cast<unsigned>(found.there) &
                     static_cast<unsigned>(lowers);
            *missing = {a, b, seen};
            missing += static_cast<unsigned>(concerned) & static_cast<unsigned>(!found.there);
        };
        compare(list.right[k], static_cast<std::uint16_t>(list.codes[k] & 0xFFFFU));
        compare(list.down[k], static_cast<std::uint16_t>(list.codes[k] >> 16U));
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
    // One thread begins with memory for the vertices of later views.
    forEach(missingEdges_.size() + 1, 1, [&](std::size_t i) {
        if (i == 0) {
            storage.prepareChunk();
        } else {
            compareEdges(storage, static_cast<int>(i) - 1);
        }
    });
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
