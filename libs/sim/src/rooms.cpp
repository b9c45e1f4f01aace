// SPDX-License-Identifier: BSD-3-Clause
// The furnished room and the flat.
#include <numbers>

#include "built_in_worlds.h"
#include "mesh_builder.h"

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;

Material paint(const char* name, float r, float g, float b) {
    Material m;
    m.name = name;
    m.colour = {r, g, b};
    return m;
}

Material wood(const char* name, float r, float g, float b, const Eigen::Vector3f& grain) {
    Material m = paint(name, r, g, b);
    m.grain = grain;
    m.noise = 1.2F;
    return m;
}

Material patterned(const char* name, float r, float g, float b, Material::Pattern pattern,
                   float size) {
    Material m = paint(name, r, g, b);
    m.pattern = pattern;
    m.patternSize = size;
    return m;
}

/// Top, four legs. Origin: middle of the floor below it.
void addTable(MeshBuilder& b, double length, double width, double height) {
    const double x = length / 2;
    const double y = width / 2;
    const double leg = 0.06;
    const double under = height - 0.04;
    b.box({-x, -y, under}, {x, y, height});
    for (const double sx : {-1.0, 1.0}) {
        for (const double sy : {-1.0, 1.0}) {
            const Point c(sx * (x - 0.08), sy * (y - 0.08), 0);
            b.box(c - Point(leg / 2, leg / 2, 0), c + Point(leg / 2, leg / 2, under),
                  kAllFaces & ~(kBottom | kTop));
        }
    }
}

/// Seat, back, four legs; the back at -y.
void addChair(MeshBuilder& b) {
    b.box({-0.21, -0.21, 0.42}, {0.21, 0.21, 0.46});
    b.box({-0.21, -0.21, 0.46}, {0.21, -0.17, 0.92}, kOnFloor);
    for (const double sx : {-1.0, 1.0}) {
        for (const double sy : {-1.0, 1.0}) {
            const Point c(sx * 0.18, sy * 0.18, 0);
            b.box(c - Point(0.02, 0.02, 0), c + Point(0.02, 0.02, 0.42),
                  kAllFaces & ~(kBottom | kTop));
        }
    }
}

/// Open compartments towards +y, the back at y = 0 against a wall, x from 0 to width.
void addShelf(MeshBuilder& b, double width, double depth, double height, int columns, int rows) {
    const double board = 0.025;
    b.box({0, 0, 0}, {board, depth, height}, kOnFloor & ~kMinY);
    b.box({width - board, 0, 0}, {width, depth, height}, kOnFloor & ~kMinY);
    b.box({board, 0, height - board}, {width - board, depth, height},
          kAllFaces & ~(kMinX | kMaxX | kMinY));
    const double pitchX = (width - board) / columns;
    const double pitchZ = (height - board) / rows;
    for (int r = 0; r < rows; ++r) {
        const double z = r * pitchZ;
        b.box({board, 0, z}, {width - board, depth, z + board},
              kAllFaces & ~(kMinX | kMaxX | kMinY | (r == 0 ? kBottom : 0U)));
    }
    for (int c = 1; c < columns; ++c) {
        for (int r = 0; r < rows; ++r) {
            b.box({c * pitchX, 0, r * pitchZ + board},
                  {c * pitchX + board, depth, (r + 1) * pitchZ},
                  kAllFaces & ~(kMinY | kBottom | kTop));
        }
    }
    b.quad({0, 0.004, 0}, {0, 0.004, height}, {width, 0.004, height}, {width, 0.004, 0});
}

void addBooks(MeshBuilder& b, const Point& corner, int count, double lean) {
    double x = 0;
    for (int i = 0; i < count; ++i) {
        const double thickness = 0.025 + 0.012 * ((i * 7) % 4);
        const double height = 0.20 + 0.02 * ((i * 5) % 4);
        const Eigen::Vector3f covers[] = {{0.62F, 0.22F, 0.18F},
                                          {0.25F, 0.40F, 0.30F},
                                          {0.72F, 0.62F, 0.42F},
                                          {0.24F, 0.30F, 0.48F},
                                          {0.50F, 0.36F, 0.24F}};
        const Eigen::Vector3f& cover = covers[(i * 3 + count) % 5];
        Material m = paint("book", cover.x(), cover.y(), cover.z());
        m.noiseSize = 0.15F;
        b.material(m);
        b.box(corner + Point(x, 0, 0), corner + Point(x + thickness, 0.17 - lean * (i % 3), height),
              kOnFloor);
        x += thickness + 0.002;
    }
}

void addSofa(MeshBuilder& b) {  // back at -y, 1.9 m wide, origin in the middle of the floor
    Material cloth = paint("sofa", 0.32F, 0.42F, 0.58F);
    cloth.noiseSize = 0.25F;
    b.material(cloth);
    b.box({-0.95, -0.45, 0.08}, {0.95, 0.45, 0.28});
    b.box({-0.95, -0.45, 0.28}, {0.95, -0.23, 0.85}, kOnFloor);
    b.box({-0.95, -0.23, 0.28}, {-0.77, 0.45, 0.60}, kOnFloor & ~kMinY);
    b.box({0.77, -0.23, 0.28}, {0.95, 0.45, 0.60}, kOnFloor & ~kMinY);
    Material cushion = paint("cushion", 0.62F, 0.36F, 0.30F);
    cushion.noiseSize = 0.2F;
    b.material(cushion);
    b.box({-0.75, -0.22, 0.28}, {-0.01, 0.43, 0.43}, kOnFloor);
    b.box({0.01, -0.22, 0.28}, {0.75, 0.43, 0.43}, kOnFloor);
    b.material(wood("leg", 0.35F, 0.25F, 0.18F, {1, 1, 4}));
    for (const double x : {-0.85, 0.85}) {
        for (const double y : {-0.37, 0.37}) {
            b.box({x - 0.03, y - 0.03, 0}, {x + 0.03, y + 0.03, 0.08},
                  kAllFaces & ~(kBottom | kTop));
        }
    }
}

void addThingsOnTable(MeshBuilder& b, double height) {
    b.material(paint("vase", 0.30F, 0.50F, 0.55F));
    b.lathe({-0.42, 0.12, height},
            {{0.05, 0.0},
             {0.075, 0.05},
             {0.08, 0.11},
             {0.055, 0.18},
             {0.035, 0.22},
             {0.05, 0.26},
             {0.044, 0.26},
             {0.028, 0.22},
             {0.045, 0.17},
             {0.066, 0.11},
             {0.06, 0.04},
             {0.0, 0.02}},
            36);
    b.material(paint("ball", 0.75F, 0.45F, 0.20F));
    b.sphere({0.02, -0.14, height + 0.08}, 0.08, 32);
    b.material(paint("carton", 0.70F, 0.58F, 0.40F));
    b.box({0.25, 0.02, height}, {0.52, 0.25, height + 0.16}, kOnFloor);
    b.material(paint("tin", 0.55F, 0.30F, 0.32F));
    b.cylinder({0.38, -0.22, height}, 0.04, 0.11, 28, kOnFloor);
    b.torus({0.438, -0.22, height + 0.055}, Point::UnitY(), 0.028, 0.007, 24, 10);
}

void addLamp(MeshBuilder& b, const Point& ceiling) {
    b.material(paint("lamp", 0.85F, 0.80F, 0.62F));
    b.lathe(ceiling, {{0.20, -0.62}, {0.10, -0.45}, {0.012, -0.42}, {0.012, 0.0}}, 32);
    b.lathe(ceiling, {{0.0, -0.44}, {0.094, -0.455}, {0.20, -0.62}}, 32);  // its inside, from below
}

void addPicture(MeshBuilder& b, const Point& centre, double width, double height) {
    // On a wall in the plane x = const, seen from +x.
    b.material(wood("frame", 0.40F, 0.28F, 0.18F, {1, 1, 1}));
    b.box(centre - Point(0, width / 2, height / 2), centre + Point(0.03, width / 2, height / 2),
          kAllFaces & ~(kMinX | kMaxX));
    Material canvas = patterned("picture", 0.55F, 0.60F, 0.50F, Material::Pattern::kTiles, 0.11F);
    canvas.noise = 1.5F;
    b.material(canvas);
    b.quad(
        centre + Point(0.03, -width / 2, -height / 2), centre + Point(0.03, width / 2, -height / 2),
        centre + Point(0.03, width / 2, height / 2), centre + Point(0.03, -width / 2, height / 2));
}

void addRoomShell(MeshBuilder& b, const Point& min, const Point& max) {
    b.material(patterned("floor", 0.62F, 0.47F, 0.33F, Material::Pattern::kPlanks, 0.14F));
    b.shell(min, max, kBottom);
    b.material(paint("ceiling", 0.86F, 0.86F, 0.84F));
    b.shell(min, max, kTop);
    b.material(paint("wall", 0.80F, 0.76F, 0.66F));
    b.shell(min, max, kMinX | kMaxX | kMinY | kMaxY);
}

}  // namespace

World makeRoom() {
    MeshBuilder b;
    addRoomShell(b, {0, 0, 0}, {6, 5, 2.7});

    b.frame({4.3, 1.5, 0}, 0.2);
    b.material(wood("table", 0.55F, 0.38F, 0.24F, {4, 1, 1}));
    addTable(b, 1.4, 0.8, 0.76);
    addThingsOnTable(b, 0.76);
    b.frame({4.1, 0.75, 0}, 0.45);
    b.material(wood("chair", 0.45F, 0.34F, 0.25F, {1, 1, 4}));
    addChair(b);

    b.frame({0.4, 0, 0});
    b.material(wood("shelf", 0.66F, 0.52F, 0.36F, {1, 1, 4}));
    addShelf(b, 1.8, 0.35, 2.0, 3, 4);
    addBooks(b, {0.05, 0.03, 1.013}, 9, 0.02);
    addBooks(b, {0.65, 0.03, 1.507}, 7, 0.03);
    addBooks(b, {1.23, 0.03, 0.519}, 8, 0.02);
    b.material(paint("pot", 0.65F, 0.38F, 0.28F));
    b.cylinder({0.32, 0.17, 0.519}, 0.09, 0.18, 28, kOnFloor);
    b.material(paint("crate", 0.48F, 0.52F, 0.40F));
    b.box({0.68, 0.05, 0.025}, {1.08, 0.31, 0.28}, kOnFloor);

    b.frame({1.55, 4.53, 0}, std::numbers::pi);
    addSofa(b);

    b.frame({0, 0, 0});
    b.material(patterned("pillar", 0.70F, 0.68F, 0.64F, Material::Pattern::kNone, 0.3F));
    b.cylinder({4.9, 3.7, 0}, 0.18, 2.7, 40, kMinX);
    b.material(patterned("partition", 0.58F, 0.66F, 0.62F, Material::Pattern::kNone, 0.3F));
    b.box({2.85, 3.1, 0}, {2.97, 5.0, 2.1}, kOnFloor & ~kMaxY);
    addPicture(b, {0, 2.4, 1.5}, 1.0, 0.7);
    addLamp(b, {3.1, 2.3, 2.7});
    b.material(paint("heater", 0.82F, 0.82F, 0.80F));
    for (int i = 0; i < 10; ++i) {  // fins under the window
        b.box({5.86, 2.0 + 0.09 * i, 0.15}, {5.98, 2.05 + 0.09 * i, 0.75});
    }
    b.material(wood("sill", 0.78F, 0.74F, 0.66F, {1, 4, 1}));
    b.box({5.75, 1.9, 0.86}, {6.0, 3.0, 0.90}, kAllFaces & ~kMaxX);

    World world;
    world.name = "room";
    world.mesh = b.take();
    world.workspace = {{0, 0, 0}, {6, 5, 2.7}};
    world.starts = {StartPose::towards({2.2, 2.3, 1.3}, {5.0, 1.5, 0.9}),
                    StartPose::towards({3.9, 4.2, 1.5}, {4.6, 1.2, 0.7}),
                    StartPose::towards({5.2, 2.4, 1.1}, {0.5, 2.3, 1.2})};
    return world;
}

World makeRooms() {
    constexpr double kHeight = 2.6;
    constexpr double kDoor = 2.05;
    constexpr double kWall = 0.12;
    MeshBuilder b;
    addRoomShell(b, {0, 0, 0}, {12, 9, kHeight});

    // A wall along x (or y, turned) with door openings, each 0.95 m wide.
    const auto wall = [&](const Point& from, double length, double yaw,
                          const std::vector<double>& doors) {
        b.frame(from, yaw);
        const auto piece = [&](double x0, double x1, double z0) {
            const unsigned sides = (x0 > 0 ? kMinX : 0U) | (x1 < length ? kMaxX : 0U);
            const unsigned under = z0 > 0 ? static_cast<unsigned>(kBottom) : 0U;
            b.box({x0, -kWall / 2, z0}, {x1, kWall / 2, kHeight},
                  kMinY | kMaxY | under | (z0 > 0 ? 0U : sides));
        };
        double x = 0;
        for (const double door : doors) {
            piece(x, door, 0);
            piece(door, door + 0.95, kDoor);
            x = door + 0.95;
        }
        piece(x, length, 0);
        b.frame({0, 0, 0});
    };
    const double quarter = std::numbers::pi / 2;
    b.material(paint("inner wall", 0.74F, 0.72F, 0.62F));
    wall({0, 3.7, 0}, 12, 0, {1.5, 5.2, 9.4});  // corridor: y 3.7 .. 5.2
    wall({0, 5.2, 0}, 12, 0, {2.2, 8.6});
    wall({4.2, 0, 0}, 3.7 - kWall / 2, quarter, {});
    wall({8.0, 0, 0}, 3.7 - kWall / 2, quarter, {1.2});
    wall({6.3, 5.2 + kWall / 2, 0}, 3.8 - kWall / 2, quarter, {2.4});

    b.frame({2.0, 1.5, 0}, 0.3);
    b.material(wood("table", 0.55F, 0.38F, 0.24F, {4, 1, 1}));
    addTable(b, 1.4, 0.8, 0.76);
    addThingsOnTable(b, 0.76);
    b.frame({4.40, 0, 0});
    b.material(wood("shelf", 0.66F, 0.52F, 0.36F, {1, 1, 4}));
    addShelf(b, 1.6, 0.35, 1.9, 2, 4);
    addBooks(b, {0.05, 0.03, 0.96}, 10, 0.02);
    b.frame({7.0, 1.9, 0}, 1.1);
    b.material(wood("chair", 0.45F, 0.34F, 0.25F, {1, 1, 4}));
    addChair(b);
    b.frame({10.3, 0.9, 0}, 0);
    addSofa(b);
    b.frame({0, 0, 0});
    b.material(paint("bed", 0.58F, 0.55F, 0.66F));
    b.box({0.3, 6.6, 0.15}, {2.3, 8.2, 0.5}, kAllFaces);
    b.box({0.0, 6.6, 0}, {0.3, 8.2, 0.95}, kOnFloor & ~kMinX);
    b.material(paint("wardrobe", 0.52F, 0.44F, 0.36F));
    b.box({4.4, 8.4, 0}, {6.1, 9.0, 2.0}, kOnFloor & ~kMaxY);
    b.material(patterned("counter", 0.60F, 0.60F, 0.56F, Material::Pattern::kTiles, 0.2F));
    b.box({8.0, 8.4, 0}, {12.0, 9.0, 0.9}, kOnFloor & ~(kMaxX | kMaxY));
    b.box({8.6, 8.65, 1.45}, {11.0, 9.0, 2.1}, kAllFaces & ~kMaxY);
    b.frame({9.0, 6.9, 0}, 0.1);
    b.material(wood("kitchen table", 0.62F, 0.48F, 0.32F, {1, 4, 1}));
    addTable(b, 1.2, 0.8, 0.75);
    b.frame({0, 0, 0});
    addPicture(b, {0, 4.45, 1.5}, 0.8, 0.6);
    addLamp(b, {2.0, 1.8, kHeight});
    addLamp(b, {9.2, 7.0, kHeight});
    b.material(paint("pillar", 0.66F, 0.64F, 0.60F));
    b.cylinder({10.8, 2.8, 0}, 0.16, kHeight, 36, kMinX);

    World world;
    world.name = "rooms";
    world.mesh = b.take();
    world.workspace = {{0, 0, 0}, {12, 9, kHeight}};
    world.starts = {StartPose::towards({1.2, 4.45, 1.4}, {6.0, 4.45, 1.2}),
                    StartPose::towards({3.2, 2.9, 1.4}, {1.5, 1.0, 0.8}),
                    StartPose::towards({10.6, 6.2, 1.4}, {8.5, 8.4, 1.0})};
    return world;
}

}  // namespace riftmap
