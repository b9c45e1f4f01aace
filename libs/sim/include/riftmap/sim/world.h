// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "riftmap/core/options.h"
#include "riftmap/core/pose.h"
#include "riftmap/sim/mesh.h"

namespace riftmap {

/// Where a camera starts. World frame, z up; no roll.
struct StartPose {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the left camera [m]
    double yaw = 0;    ///< [rad] of the view about z, from the x axis towards the y axis
    double pitch = 0;  ///< [rad] of the view above the horizon

    Pose pose() const;  ///< of the left camera's optical frame
    /// A start at `position` that looks at `target`.
    static StartPose towards(const Eigen::Vector3d& position, const Eigen::Vector3d& target);
};

/// A surface to explore, with what is needed to start: metres, z up.
struct World {
    std::string name;
    TriangleMesh mesh;
    Bounds workspace;               ///< where the camera may be unless the platform says otherwise
    std::vector<StartPose> starts;  ///< at least three, clear of the surface
};

/// Section [World].
struct WorldOptions {
    /// Built-in worlds are made by code: nothing has to be shipped.
    enum class Name { kRoom, kRooms, kCourtyard, kSculpture, kPlane, kSteps };
    /// Where the camera of a mesh file may be.
    enum class ViewSpace {
        kAround,  ///< in the mesh's bounding box and `margin` around it
        kInside,  ///< in the mesh's bounding box
    };

    Name name = Name::kRoom;
    std::string mesh;  ///< mesh file; the world is this file if it is not empty
    MeshOptions meshOptions;
    ViewSpace viewSpace = ViewSpace::kAround;  ///< of a mesh file
    double margin = 1.5;                       ///< [m]
    double noise = 1.0;  ///< contrast of the noise on surfaces without texture; 0 = none

    void describe(OptionTable& table);
};

/// Builds a built-in world or reads the mesh file; starts and workspace included. Throws MeshError.
World makeWorld(const WorldOptions& options);

}  // namespace riftmap
