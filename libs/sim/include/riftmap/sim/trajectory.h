// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "riftmap/core/options.h"
#include "riftmap/core/tum.h"
#include "riftmap/sim/ray_caster.h"
#include "riftmap/sim/world.h"

namespace riftmap {

/// Section [Trajectory]: where a simulated camera is carried when nobody plans.
struct TrajectoryOptions {
    enum class Kind {
        kOrbit,      ///< a circle, looking to its middle or away from it
        kLawnmower,  ///< stops in rows to and fro over the workspace, some views at each
        kWaypoints,  ///< straight from pose to pose
        kTum,        ///< a file
    };
    enum class Look { kAuto, kInward, kOutward };

    Kind kind = Kind::kOrbit;
    std::string file;               ///< of poses t x y z qx qy qz qw of the left optical frame
    int views = 60;                 ///< orbit and waypoints
    std::vector<double> centre;     ///< of the orbit x y z [m]; empty: the middle of the world
    double radius = 0;              ///< of the orbit [m]; 0: from the size of the world
    Look look = Look::kAuto;        ///< auto: inward round an object, outward in a building
    double pitch = 0;               ///< of an outward orbit and of the lawn-mower [rad]
    double spacing = 1.0;           ///< between stops and rows of the lawn-mower [m]
    double height = 1.4;            ///< of the lawn-mower above the workspace's floor [m]
    int directions = 4;             ///< views at a stop, evenly round
    std::vector<double> waypoints;  ///< x y z yaw_deg pitch_deg, again and again
    double clearance = 0.1;         ///< least distance of a view from any surface [m]
    double rate = 10;               ///< views a second, for the timestamps [Hz]

    void describe(OptionTable& table);
};

/// Poses of the left camera with times that begin at 1.7e9 s. The lawn-mower leaves out stops that
/// come too near to a surface; any other pose that does is an error. Throws ConfigError, FileError.
std::vector<TimedPose> makeTrajectory(const TrajectoryOptions& options, const World& world,
                                      const RayCaster& caster);

/// Section [PoseNoise]: what a rig that measures its own poses gets wrong.
struct PoseNoiseOptions {
    double position = 0;       ///< standard deviation of each coordinate, a view [m]
    double rotation = 0;       ///< about a random axis, a view [rad]
    double positionDrift = 0;  ///< standard deviation of a random walk, after one metre [m]
    double rotationDrift = 0;  ///< after one metre [rad]

    bool any() const {
        return position > 0 || rotation > 0 || positionDrift > 0 || rotationDrift > 0;
    }
    void describe(OptionTable& table);
};

/// The poses as that rig believes them; the first one is exact but for the noise of a view.
std::vector<TimedPose> withPoseNoise(const std::vector<TimedPose>& truth,
                                     const PoseNoiseOptions& options, std::uint64_t seed);

}  // namespace riftmap
