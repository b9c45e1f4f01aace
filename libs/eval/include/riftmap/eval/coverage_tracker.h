// SPDX-License-Identifier: BSD-3-Clause
// Coverage after every view of an exploring run, from what the view changed.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "riftmap/eval/coverage.h"
#include "riftmap/eval/point_index.h"

namespace riftmap {

/// The same figures as CoverageJudge::coverage(), for a map that changes little from call to call.
/// A call compares all vertices with those of the call before, then looks again only at samples
/// near vertices that came, went or moved, and of those only at the ones whose nearest known
/// vertex is not there any more or too far off. Not thread-safe; works on all threads; the results
/// do not depend on their number.
class CoverageTracker {
 public:
    /// `judge` must outlive the tracker. 5 bytes a sample, 12 a vertex.
    explicit CoverageTracker(const CoverageJudge& judge);

    /// `vertices`: the whole map [m]. A vertex keeps its index from call to call; an index without
    /// a vertex holds a position that is not finite.
    std::vector<Coverage> update(std::span<const Eigen::Vector3f> vertices);

 private:
    using Cell = std::uint32_t;

    std::size_t cellOf(const Eigen::Vector3f& point) const;
    void mark(const Eigen::Vector3f& point);
    std::vector<Cell> spread(const std::vector<Cell>& cells, std::uint8_t bit);
    std::uint8_t look(std::size_t sample, std::span<const Eigen::Vector3f> vertices,
                      const PointIndex& index, const std::vector<std::uint32_t>& ids);
    std::vector<Coverage> figures() const;

    const CoverageJudge& judge_;
    std::vector<float> limits_;            ///< the judge's deltas, a float's rounding wider [m]
    Eigen::Vector3d min_;                  ///< corner of the cells' box [m]
    double cell_;                          ///< edge, at least the largest delta [m]
    Eigen::Array3i size_;                  ///< cells along x, y, z
    std::vector<std::uint8_t> flags_;      ///< a cell: what is to be done there, during a call
    std::vector<Cell> changed_;            ///< cells with a vertex that came, went or moved
    std::vector<std::uint32_t> order_;     ///< samples by cell
    std::vector<std::uint32_t> start_;     ///< first of each cell in order_, and the end
    std::vector<Eigen::Vector3f> before_;  ///< vertices of the call before
    std::vector<std::uint32_t> witness_;   ///< a sample: its nearest vertex when last looked at
    std::vector<std::uint8_t> level_;  ///< a sample: index of its smallest delta, or their count
    std::vector<std::size_t> all_, seen_;  ///< samples, observable ones, a level
};

}  // namespace riftmap
