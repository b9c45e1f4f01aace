// SPDX-License-Identifier: BSD-3-Clause
// Algorithm 2 and section VII of the paper: a view becomes part of the map.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "association.h"
#include "fuse_kernel.h"
#include "rift_finder.h"
#include "riftmap/core/parallel.h"
#include "riftmap/graph/graph_storage.h"
#include "riftmap/graph/pixel_graph.h"
#include "view_points.h"

namespace riftmap {

/// f(i) for each i of [0, n), `atOnce` in one go.
template <class F>
void forEach(std::size_t n, std::size_t atOnce, F&& f) {
    parallelFor(n, atOnce, [&f](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i) {
            f(i);
        }
    });
}

/// Merges views; keeps its buffers from one to the next.
class Merger {
 public:
    explicit Merger(const GraphOptions& options) : options_(options) {}

    /// The view must have been checked. `area` is kept up to date [compact::areaUnits].
    MergeResult merge(const View& view, GraphStorage& storage, RiftFinder& rifts,
                      std::int64_t& area);
    const MergeTimes& times() const { return times_; }
    std::size_t memoryBytes() const;

 private:
    /// What a page's vertices ask for while they are fused in parallel.
    struct PageWork {
        std::int64_t area = 0;                           ///< change [compact::areaUnits]
        std::uint64_t moved = 0;                         ///< slots whose position changed
        std::uint64_t doomed = 0;                        ///< slots to delete
        bool touched = false;                            ///< rifts must be looked at again
        std::vector<std::pair<VertexId, VertexId>> cut;  ///< high edges seen through
    };
    struct NewEdge {
        VertexId a, b;
        std::uint16_t code;
    };

    /// What a strip of rows contributes to the growth of the map.
    struct FreshStrip {
        std::vector<std::uint32_t> pixels;  ///< that become vertices
        /// The blocks of these pixels: key, how many in a row.
        std::vector<std::pair<BlockKey, std::uint32_t>> runs;
        std::size_t first = 0;        ///< of its vertices in freshIds_
        std::size_t edges = 0;        ///< between new vertices
        std::int64_t area = 0;        ///< [compact::areaUnits]
        std::vector<VertexId> toFit;  ///< vertices whose normal comes from their neighbours
    };
    /// What compareEdges() works on; one a thread, only the first so many elements count.
    struct EdgeScratch {
        struct Lower {
            std::uint16_t* there;
            VertexId a, b;
            std::uint16_t code;
        };
        std::vector<VertexId> from, right, down;
        std::vector<std::uint32_t> codes;
        std::vector<Lower> lower;      ///< edges that the map has with a larger weight
        std::vector<NewEdge> missing;  ///< those that it lacks
        void resize(std::size_t pixels) {
            for (auto* values : {&from, &right, &down, &codes}) {
                values->resize(pixels);
            }
            lower.resize(2 * pixels);
            missing.resize(2 * pixels);
        }
    };

    void prefetchPage(const GraphStorage& storage, std::uint32_t which) const;
    void findSeenThroughEdges(const GraphStorage& storage, std::uint32_t which);
    void fusePage(GraphStorage& storage, std::uint32_t which);
    void passOver(Page& page, std::uint32_t slot, std::uint32_t candidate, PageWork& work);
    void fuseAlongRay(Page& page, std::uint32_t slot, const Candidate& seen, float depth,
                      float pixelSigma, PageWork& work);
    bool sameSide(std::uint32_t normal, std::size_t pixel) const;
    bool lookedThrough(const Candidate& candidate) const;
    void deleteSeenThrough(GraphStorage& storage, RiftFinder& rifts, MergeResult& result);
    void grow(GraphStorage& storage, MergeResult& result);
    void findFresh(const GraphStorage& storage, int strip);
    std::size_t connectFresh(Page& page, std::uint32_t slot, std::size_t i) const;
    void fillFresh(GraphStorage& storage, FreshStrip& strip);
    void connectMatched(GraphStorage& storage, MergeResult& result);
    void compareEdges(GraphStorage& storage, int strip);
    bool wanted(const GraphStorage& storage, const NewEdge& edge) const;
    void refreshNormals(GraphStorage& storage);
    void finish(GraphStorage& storage, RiftFinder& rifts, std::int64_t& area);
    std::uint8_t openBits(std::uint8_t kinds, std::uint8_t state, float sigma) const {
        return riftmap::openBits(kinds, state, sigma, options_.typedOpenness,
                                 static_cast<float>(options_.targetResolution));
    }
    /// Seen at less than 60 degrees: its share of the surface can be told.
    bool frontal(std::size_t pixel) const {
        return points_.stretch[pixel] >= 1.0F && points_.stretch[pixel] <= 2.0F;
    }
    bool paper() const { return options_.fusion == GraphOptions::Fusion::kFirst; }

    GraphOptions options_;
    MergeTimes times_;
    ViewPoints points_;
    Association seen_;
    std::vector<PageWork> work_;         ///< beside seen_.pages
    std::vector<VertexId> vertexOf_;     ///< pixel -> vertex that it shows
    std::vector<VertexId> freshIds_;     ///< of the pixels that became vertices, strip by strip
    std::vector<std::uint8_t> isFresh_;  ///< pixel -> became a vertex
    std::vector<std::uint32_t> touchedBlocks_;
    std::vector<std::uint32_t> freshPages_;
    std::vector<FreshStrip> freshStrips_;
    std::vector<std::vector<NewEdge>> missingEdges_;  ///< of strips of rows
};

}  // namespace riftmap
