// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "riftmap/core/view.h"
#include "riftmap/graph/pixel_graph.h"
#include "riftmap/planner/sensor_model.h"

namespace riftmap {

/// What the views looked through, by the pixel: for places too near a surface for voxels. Keeps a
/// depth image a view (4 bytes a pixel). Map frame, metres. Reading is thread-safe while nothing
/// writes.
class SeenThrough {
 public:
    /// `backgroundIsFree`: what lies before pixels without a match was seen through, but for
    /// pixels that one camera alone sees and those beside surface too near to be matched.
    void add(const View& view, const SensorModel& sensor, bool backgroundIsFree);
    /// True if some view measured only what lies behind this place, by two standard deviations.
    /// Time grows with the number of views.
    bool at(const Eigen::Vector3d& place) const;
    std::size_t views() const { return views_.size(); }

 private:
    struct Depths {
        StereoCamera camera;
        Pose camera_T_world;
        std::vector<float> depth;  ///< up to which was seen through; 0: not known
    };
    std::vector<Depths> views_;
};

/// What may still be hidden beside the rim of a surface.
struct Gap {
    double width = 0;                                 ///< farther from the map than was asked [m]
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< the unknown place nearest to the rim
};

/// Walks around a rim at a few distances, from the side that the surface was seen from, over the
/// rim, to its back: the surface that goes on there must come by. Where surface that is known
/// comes first (within the resolution of the map) the tear is closed but for its edges; where all
/// is seen through, the surface ends. `normal`, `outward`: unit vectors at the rim.
std::optional<Gap> gapBeside(const PixelGraph& graph, const SeenThrough& seen,
                             const Eigen::Vector3d& rim, const Eigen::Vector3d& normal,
                             const Eigen::Vector3d& outward, double resolution);

}  // namespace riftmap
