// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "riftmap/core/view.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/free_space.h"

namespace riftmap {

/// What the views looked through, by the pixel: for places too near a surface for voxels. Keeps a
/// depth image a view (4 bytes a pixel). Map frame, metres. Reading is thread-safe while nothing
/// writes.
class SeenThrough {
    struct Depths;

 public:
    SeenThrough();
    ~SeenThrough();
    SeenThrough(const SeenThrough&) = delete;
    SeenThrough& operator=(const SeenThrough&) = delete;

    /// `empty`: from FreeSpace::emptyPixels(), for this view.
    void add(const View& view, const EmptyPixels& empty);

    /// Some of the views; valid until the next add().
    class Views {
     public:
        /// True if one of them measured only what lies behind this place, by two standard
        /// deviations. Time grows with their number.
        bool seeThrough(const Eigen::Vector3d& place) const;
        std::size_t size() const { return depths_.size(); }

     private:
        friend class SeenThrough;
        std::vector<const Depths*> depths_;  ///< the newest first
    };
    /// All that measured something within this box or behind it: whatever lies in it, the others
    /// did not see through.
    Views into(const Eigen::AlignedBox3d& box) const;

 private:
    std::vector<Depths> views_;
};

/// What may still be hidden beside the rim of a surface.
struct Gap {
    double width = 0;                                 ///< farther from the map than was asked [m]
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< the unknown place nearest to the rim
    /// How the surface faces if it runs from the rim to that place or, where that lies before the
    /// rim's own plane, straight on; length at most 1, zero if not known.
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

/// Width of a gap that goes on beyond the farthest place looked at [resolutions].
inline constexpr double kWidestGap = 3;

/// Walks around a rim at a few distances, from the side that the surface was seen from, over the
/// rim, to its back: the surface that goes on there must come by. Where surface that is known
/// comes first (within the resolution of the map) the tear is closed but for its edges; where all
/// is seen through, the surface ends. `normal`, `outward`: unit vectors at the rim.
std::optional<Gap> gapBeside(const PixelGraph& graph, const SeenThrough::Views& seen,
                             const Eigen::Vector3d& rim, const Eigen::Vector3d& normal,
                             const Eigen::Vector3d& outward, double resolution);

}  // namespace riftmap
