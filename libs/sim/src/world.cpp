// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/world.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "built_in_worlds.h"
#include "riftmap/sim/ray_caster.h"

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;

World makeBuiltIn(WorldOptions::Name name) {
    switch (name) {
        case WorldOptions::Name::kRooms:
            return makeRooms();
        case WorldOptions::Name::kCourtyard:
            return makeCourtyard();
        case WorldOptions::Name::kSculpture:
            return makeSculpture();
        case WorldOptions::Name::kPlane:
            return makePlane();
        case WorldOptions::Name::kSteps:
            return makeSteps();
        case WorldOptions::Name::kRoom:
            break;
    }
    return makeRoom();
}

/// Three poses round an object, each looking at its centre, near the edge of the workspace.
std::vector<StartPose> startsAround(const Bounds& object, double margin) {
    std::vector<StartPose> starts;
    for (const double azimuth : {0.3, 2.4, 4.5}) {
        const Point side(std::cos(azimuth), std::sin(azimuth), 0);
        // Just outside the box, but for a tenth of the margin inside the workspace.
        const Point half = object.size() / 2 + Point::Constant(0.9 * margin);
        const double reach = std::min(half.x() / std::abs(side.x()), half.y() / std::abs(side.y()));
        const Point position = object.centre() + reach * side + Point(0, 0, 0.4 * margin);
        starts.push_back(StartPose::towards(position, object.centre()));
    }
    return starts;
}

/// True if there is surface on all four sides and below: not outside the house.
bool enclosed(const RayCaster& caster, const Point& p) {
    const Point directions[] = {Point::UnitX(), -Point::UnitX(), Point::UnitY(), -Point::UnitY(),
                                -Point::UnitZ()};
    return std::all_of(std::begin(directions), std::end(directions),
                       [&](const Point& d) { return caster.cast(p, d).has_value(); });
}

/// Roomy places inside a building, at most eye height above its floor, far from each other.
std::vector<StartPose> startsInside(const TriangleMesh& mesh, const Bounds& box) {
    const RayCaster caster(mesh);
    const double height = box.min.z() + std::min(1.3, box.size().z() / 2);
    constexpr int kGrid = 40;
    std::vector<std::pair<double, Point>> places;
    for (int i = 1; i < kGrid; ++i) {
        for (int j = 1; j < kGrid; ++j) {
            const Point p(box.min.x() + box.size().x() * i / kGrid,
                          box.min.y() + box.size().y() * j / kGrid, height);
            const auto nearest = caster.closest(p, 2.0);
            if (enclosed(caster, p)) {
                places.emplace_back(nearest ? nearest->distance : 2.0, p);
            }
        }
    }
    std::vector<StartPose> starts;
    while (starts.size() < 3 && !places.empty()) {
        const auto roomiest =
            std::max_element(places.begin(), places.end(),
                             [](const auto& a, const auto& b) { return a.first < b.first; });
        const Point p = roomiest->second;
        starts.push_back(StartPose::towards(p, {box.centre().x(), box.centre().y(), p.z()}));
        std::erase_if(places, [&](const auto& place) {
            return (place.second - p).norm() < box.size().head<2>().norm() / 6;
        });
    }
    return starts;
}

World readWorld(const WorldOptions& options) {
    World world;
    world.name = std::filesystem::path(options.mesh).stem().string();
    world.mesh = loadMesh(options.mesh, options.meshOptions);
    const Bounds box = bounds(world.mesh);
    if (options.viewSpace == WorldOptions::ViewSpace::kInside) {
        world.workspace = box;
        world.starts = startsInside(world.mesh, box);
    } else {
        world.workspace = {box.min - Point::Constant(options.margin),
                           box.max + Point::Constant(options.margin)};
        world.starts = startsAround(box, options.margin);
    }
    return world;
}

}  // namespace

Pose StartPose::pose() const {
    const Point forward(std::cos(pitch) * std::cos(yaw), std::cos(pitch) * std::sin(yaw),
                        std::sin(pitch));
    // Written out, not through lookAt: straight up or down, yaw still says which way is right.
    Pose pose;
    pose.rotation.col(0) = Point(std::sin(yaw), -std::cos(yaw), 0);
    pose.rotation.col(1) = forward.cross(pose.rotation.col(0));
    pose.rotation.col(2) = forward;
    pose.translation = position;
    return pose;
}

StartPose StartPose::towards(const Point& position, const Point& target) {
    const Point d = target - position;
    return {position, std::atan2(d.y(), d.x()), std::atan2(d.z(), std::hypot(d.x(), d.y()))};
}

void WorldOptions::describe(OptionTable& table) {
    table.section("World", "The surface to explore: built in, or a mesh file.");
    table.addChoice("name", name,
                    {{"room", Name::kRoom},
                     {"rooms", Name::kRooms},
                     {"courtyard", Name::kCourtyard},
                     {"sculpture", Name::kSculpture},
                     {"plane", Name::kPlane},
                     {"steps", Name::kSteps}},
                    "Built-in world; without effect if `mesh` is set.");
    table.add("mesh", mesh, "Mesh file (OBJ, PLY, OFF, STL, glTF) to be the world; empty: `name`.");
    table.add("scale", meshOptions.scale, 1e-6, 1e6, "", "Metres per unit of the mesh file.");
    table.add(
        "size", meshOptions.size, 0, 2000, "m",
        "Scales the mesh about its own origin until its largest side is this long; 0: `scale`.");
    table.addChoice("up_axis", meshOptions.upAxis,
                    {{"z", MeshOptions::UpAxis::kZ}, {"y", MeshOptions::UpAxis::kY}},
                    "Axis of the mesh file that points up.");
    table.add("textures", meshOptions.textures, "Read the mesh file's texture images.");
    table.addChoice(
        "view_space", viewSpace, {{"around", ViewSpace::kAround}, {"inside", ViewSpace::kInside}},
        "Where the camera of a mesh file may be, and starts, unless [Platform] says so: "
        "around an object, or inside a building's bounding box.");
    table.add("margin", margin, 0.01, 1000, "m", "Width of the view space around an object.");
    table.add("noise", noise, 0, 3, "",
              "Contrast of the speckle on surfaces without texture image; 0: bare walls.");
}

World makeWorld(const WorldOptions& options) {
    World world = options.mesh.empty() ? makeBuiltIn(options.name) : readWorld(options);
    for (Material& material : world.mesh.materials) {
        material.noise *= static_cast<float>(options.noise);
    }
    return world;
}

}  // namespace riftmap
