// SPDX-License-Identifier: BSD-3-Clause
// Algorithm 2's first half: which vertex of the map does each pixel of a view show?
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "match_kernel.h"
#include "riftmap/graph/graph_storage.h"
#include "riftmap/graph/pixel_graph.h"
#include "view_points.h"

namespace riftmap {

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
    };

    /// Culls blocks and pages against the frustum and projects what is left, eq. (4).
    void project(const GraphStorage& storage, const ViewPoints& view, const GraphOptions& options);
    /// Each pixel takes the nearest candidate within its gate.
    void match(const ViewPoints& view, const GraphOptions& options);

    std::size_t candidateCount() const { return pages.size() * Page::kSize; }
    VertexId idOf(std::uint32_t candidate) const {
        return GraphStorage::idOf(pages[candidate / Page::kSize], candidate % Page::kSize);
    }
    /// The pixel that fits a candidate best, kNone where no pixel matched it.
    std::uint32_t bestPixel(std::uint32_t candidate) const {
        return static_cast<std::uint32_t>(best[candidate]);
    }

    std::vector<std::uint32_t> pages;          ///< pages in view, ascending
    std::vector<Candidate> candidates;         ///< 64 a page of `pages`
    std::vector<std::uint32_t> matchOf;        ///< pixel -> candidate or kNone
    std::vector<std::uint64_t> best;           ///< candidate -> distance bits << 32 | pixel
    std::vector<std::uint8_t> flags;           ///< candidate -> Flag
    std::vector<std::uint32_t> areaOf;         ///< candidate -> surface of its pixels [kAreaUnit]
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
    void cull(const GraphStorage& storage, const ViewPoints& view);
    void computeReach(const ViewPoints& view, const GraphOptions& options);
    void projectPage(const GraphStorage& storage, const ViewPoints& view, std::uint32_t which);
    void matchByDistance(const ViewPoints& view, float gamma, int row, float* distance,
                         std::int32_t* found) const;
    void claim(const ViewPoints& view, float targetResolution, std::size_t pixel,
               std::uint32_t candidate, float distance);

    static constexpr int kTile = 8;
    int tileColumns_ = 0, tileRows_ = 0;
    std::vector<float> reach_;  ///< tile -> depth beyond which nothing can match there
    float farthest_ = 0;
    void sortByPixel();

    // What matching needs of a candidate, in the order of pixels: neighbours in a row of the image
    // are neighbours in memory.
    std::vector<float> entryU_, entryV_, entryZ_, entryNoise_;  ///< noise: (kNoiseGate sigma)^2
    std::vector<std::int32_t> entryCandidate_;
    std::vector<std::uint32_t> start_;    ///< pixel -> its first entry; one more at the end
    std::vector<std::uint32_t> pixelOf_;  ///< candidate -> pixel or kNone
};

}  // namespace riftmap
