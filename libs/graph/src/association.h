// SPDX-License-Identifier: BSD-3-Clause
// Algorithm 2's first half: which vertex of the map does each pixel of a view show?
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "match_kernel.h"
#include "project_kernel.h"
#include "riftmap/graph/graph_storage.h"
#include "riftmap/graph/pixel_graph.h"
#include "view_points.h"

namespace riftmap {

/// Asks for memory that will be read soon.
inline void prefetch(const void* from, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; i += 64) {
        __builtin_prefetch(static_cast<const char*>(from) + i);
    }
}

/// A vertex of the map as the view's camera would see it.
struct Candidate {
    float u = 0, v = 0;  ///< column, row [px]
    float z = 0;         ///< depth [m]; 0 = not in view
    float sigma = 0;     ///< of the vertex [m]
};

/// Buffers are kept from view to view. Everything is a function of map, view and options alone,
/// whatever the number of threads: ties go to the smaller vertex id and the smaller pixel.
class Association {
 public:
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
    /// What the pixels that matched a candidate say together.
    enum Flag : std::uint8_t {
        kSomeSurrounded = 1,  ///< one had all four neighbours valid and near
        kSomeOpen = 2,        ///< one had not
        kSomeFine = 4,        ///< one samples as densely as asked for
        kKindsShift = 3,      ///< above: OpenKind bits of all of them
    };

    /// Culls blocks and pages against the frustum and projects what is left, eq. (4).
    void project(const GraphStorage& storage, const ViewPoints& view, const GraphOptions& options);
    /// Each pixel takes the nearest candidate within its gate.
    void match(const ViewPoints& view, const GraphOptions& options);

    /// What the pixels that matched a candidate say together.
    struct Claims {
        std::uint64_t best = kNoBest;  ///< least of: distance bits << 32 | pixel
        std::uint32_t area = 0;        ///< surface of its pixels [kAreaUnit]
        std::uint32_t flags = 0;       ///< Flag
    };

    std::size_t candidateCount() const { return pages.size() * Page::kSize; }
    VertexId idOf(std::uint32_t candidate) const {
        return GraphStorage::idOf(pages[candidate / Page::kSize], candidate % Page::kSize);
    }
    Candidate candidate(std::uint32_t k) const { return {u_[k], v_[k], z_[k], sigma_[k]}; }
    bool inView(std::uint32_t k) const {
        return ((inView_[k / Page::kSize] >> (k % Page::kSize)) & 1U) != 0;
    }
    /// Slots of pages[which] in view.
    std::uint64_t slotsInView(std::uint32_t which) const { return inView_[which]; }
    /// Of the slots of pages[which] before the view [m].
    const float* sigmas(std::uint32_t which) const {
        return &sigma_[std::size_t{which} * Page::kSize];
    }
    /// The pixel that fits a candidate best, kNone where no pixel matched it.
    std::uint32_t bestPixel(std::uint32_t candidate) const {
        return static_cast<std::uint32_t>(claims[candidate].best);
    }
    std::size_t memoryBytes() const;

    std::vector<std::uint32_t> pages;          ///< pages in view, ascending; 64 candidates each
    std::vector<std::uint32_t> matchOf;        ///< pixel -> candidate or kNone
    std::vector<Claims> claims;                ///< of a candidate
    std::size_t matched = 0;                   ///< pixels with a match
    static constexpr float kAreaUnit = 1e-9F;  ///< [m^2]

    /// The gate of a pixel. The paper's is plain gamma.
    static Gate gate(const ViewPoints& view, std::size_t pixel, const GraphOptions& options) {
        const auto gamma = static_cast<float>(options.gamma);
        return options.fusion == GraphOptions::Fusion::kFirst
                   ? Gate{gamma, gamma}
                   : gateOf(gamma, view.z[pixel] * view.footprint, view.sigma[pixel],
                            view.stretch[pixel]);
    }

 private:
    static constexpr std::uint64_t kNoBest = 0xFFFFFFFFFFFFFFFFULL;
    static constexpr int kTile = 8;
    static constexpr int kStripRows = 16;

    /// Rows of the image that one task works on, so that nobody else writes to their pixels or to
    /// the candidates that lie on them.
    struct Strip {
        struct Claim {
            std::uint32_t candidate, pixel;
            float distance;
        };
        std::size_t entries = 0, matched = 0;
        std::vector<Claim> foreign;   ///< of candidates on other strips
        std::vector<float> distance;  ///< of a row
        std::vector<std::int32_t> found;
    };

    void cull(const GraphStorage& storage, const ViewPoints& view);
    void computeReach(const ViewPoints& view, const GraphOptions& options);
    void projectPages(const GraphStorage& storage, const ViewPoints& view);
    void sortByPixel(const ViewPoints& view);
    void countEntries(const ViewPoints& view, int strip);
    void placeEntries(const ViewPoints& view, int strip, std::size_t before);
    template <class F>
    void forEachCandidateOn(int firstRow, int endRow, int width, F&& f) const;
    void matchStrip(const ViewPoints& view, const GraphOptions& options, int index);
    void matchByDistance(const ViewPoints& view, float gamma, int row, float* distance,
                         std::int32_t* found) const;
    void claim(const ViewPoints& view, float targetResolution, const Strip::Claim& claim);

    int tileColumns_ = 0, tileRows_ = 0;
    std::vector<float> ownReach_, reach_;  ///< tile -> depth beyond which nothing can match there
    float farthest_ = 0;
    std::vector<Strip> strips_;

    // Of a candidate.
    std::vector<float> u_, v_, z_, sigma_;
    std::vector<std::uint32_t> pixelOf_;  ///< only where in view
    // Of a page of candidates.
    std::vector<std::uint64_t> inView_;
    std::vector<std::pair<int, int>> rowsOf_;  ///< first and last row of its pixels

    // What matching needs of a candidate, in the order of pixels: neighbours in a row of the image
    // are neighbours in memory.
    std::vector<MatchEntry> entries_;
    std::vector<std::uint32_t> start_;  ///< MatchRow::start
};

}  // namespace riftmap
