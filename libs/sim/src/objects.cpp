// SPDX-License-Identifier: BSD-3-Clause
// The sculpture, the plane and the steps.
#include <cmath>
#include <numbers>

#include "built_in_worlds.h"
#include "mesh_builder.h"

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;

Material matter(const char* name, float r, float g, float b) {
    Material m;
    m.name = name;
    m.colour = {r, g, b};
    m.noiseSize = 0.25F;
    return m;
}

/// (2, 3) torus knot about the z axis.
Point knot(double s) {
    const double a = 2 * std::numbers::pi * s;
    const double r = 0.17 + 0.075 * std::cos(3 * a);
    return {r * std::cos(2 * a), r * std::sin(2 * a), 0.075 * std::sin(3 * a)};
}

/// A plinth with a tunnel along y.
void addPlinth(MeshBuilder& b) {
    const double x = 0.30;
    const double y = 0.22;
    const double top = 0.26;
    const double t = 0.11;  // half the tunnel's width
    const double low = 0.05;
    const double high = 0.20;
    b.box({-x, -y, 0}, {x, y, top}, kMinX | kMaxX | kBottom | kTop);
    for (const double side : {-1.0, 1.0}) {
        const auto face = [&](double x0, double x1, double z0, double z1) {
            b.box({x0, -y, z0}, {x1, y, z1}, side < 0 ? kMinY : kMaxY);
        };
        face(-x, -t, 0, top);
        face(t, x, 0, top);
        face(-t, t, 0, low);
        face(-t, t, high, top);
    }
    b.shell({-t, -y, low}, {t, y, high}, kMinX | kMaxX | kBottom | kTop);
}

std::vector<StartPose> startsAround(const Point& centre, double distance) {
    std::vector<StartPose> starts;
    for (const double azimuth : {0.3, 2.4, 4.5}) {
        const Point offset(std::cos(azimuth), std::sin(azimuth), 0.35);
        starts.push_back(StartPose::towards(centre + distance * offset, centre));
    }
    return starts;
}

void addFloor(MeshBuilder& b) {
    Material floor = matter("floor", 0.60F, 0.58F, 0.52F);
    floor.noiseSize = 0.5F;
    b.material(floor);
    b.quad({-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0});
}

}  // namespace

World makeSculpture() {
    MeshBuilder b;
    b.material(matter("plinth", 0.60F, 0.57F, 0.52F));
    addPlinth(b);
    b.material(matter("bowl", 0.42F, 0.52F, 0.55F));
    b.lathe({-0.17, 0, 0.26},
            {{0.05, 0.0},
             {0.045, 0.05},
             {0.10, 0.08},
             {0.15, 0.14},
             {0.17, 0.22},
             {0.162, 0.22},
             {0.142, 0.145},
             {0.094, 0.09},
             {0.04, 0.065},
             {0.0, 0.06}},
            48);
    b.material(matter("post", 0.52F, 0.46F, 0.38F));
    for (const double side : {-1.0, 1.0}) {  // up to two of the knot's three lowest points
        b.cylinder({0.225, side * 0.147, 0.26}, 0.025, 0.285, 32, 0);
    }
    b.material(matter("knot", 0.68F, 0.46F, 0.30F));
    b.frame({0.14, 0, 0.62});
    b.tube(knot, 0.035, 240, 24, true);
    b.frame({0, 0, 0});
    b.material(matter("ring", 0.46F, 0.42F, 0.58F));
    b.torus({0.14, 0, 0.62}, Point(0.3, 1, 0.1), 0.35, 0.018, 120, 18);
    b.material(matter("rods", 0.60F, 0.62F, 0.45F));
    for (int i = 0; i < 4; ++i) {
        const double y = -0.15 + 0.1 * i;
        b.tube(
            [&](double s) -> Point {
                return {-0.28 - 0.12 * s, y, 0.24 + 0.5 * s};
            },
            0.008, 8, 12, false);
    }
    b.material(matter("fin", 0.56F, 0.36F, 0.38F));
    b.box({-0.40, -0.18, 0.70}, {-0.385, 0.18, 0.90});  // a plate 15 mm thick on the rods

    World world;
    world.name = "sculpture";
    world.mesh = b.take();
    const Bounds box = bounds(world.mesh);
    world.workspace = {box.min - Point::Constant(1.5), box.max + Point::Constant(1.5)};
    world.starts = startsAround(box.centre(), 1.5);
    return world;
}

World makePlane() {
    MeshBuilder b;
    addFloor(b);
    World world;
    world.name = "plane";
    world.mesh = b.take();
    world.workspace = {{-3, -3, 0}, {3, 3, 3}};
    world.starts = {StartPose::towards({-0.5, 0, 1.5}, {0, 0, 0}),
                    StartPose::towards({1, 1, 1.2}, {0.5, 0.5, 0}),
                    StartPose::towards({0, -1.5, 2}, {0, -0.5, 0})};
    return world;
}

World makeSteps() {
    MeshBuilder b;
    addFloor(b);
    b.material(matter("steps", 0.52F, 0.56F, 0.62F));
    for (int i = 0; i < 5; ++i) {  // the last step is the highest; each stands on the floor
        const double x = -1.2 + 0.3 * i;
        const double height = 0.17 * (i + 1);
        b.box({x, 0.5, 0}, {x + 0.3, 1.7, height}, kMinY | kMaxY | kTop | (i == 4 ? kMaxX : 0U));
        b.quad({x, 0.5, height - 0.17}, {x, 0.5, height}, {x, 1.7, height},
               {x, 1.7, height - 0.17});
    }
    b.material(matter("blocks", 0.64F, 0.48F, 0.36F));
    const double heights[] = {0.05, 0.1, 0.2, 0.4, 0.8};
    for (int i = 0; i < 5; ++i) {
        const double x = -1.9 + 0.8 * i;
        b.box({x, -1.4, 0}, {x + 0.4, -0.7, heights[i]}, kOnFloor);
    }
    World world;
    world.name = "steps";
    world.mesh = b.take();
    world.workspace = {{-3, -3, 0}, {3, 3, 3}};
    world.starts = {StartPose::towards({-0.5, 0, 1.6}, {0.1, 0.4, 0}),
                    StartPose::towards({-2, -2.2, 1.2}, {-1, -1, 0.2}),
                    StartPose::towards({1.8, 0.8, 1.8}, {0.3, 0.9, 0.5})};
    return world;
}

}  // namespace riftmap
