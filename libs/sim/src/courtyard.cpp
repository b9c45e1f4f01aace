// SPDX-License-Identifier: BSD-3-Clause
// A college courtyard: four facades with windows, arches and alleys round a lawn.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>

#include "built_in_worlds.h"
#include "mesh_builder.h"

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;

constexpr double kHeight = 9.0;      // [m] of the facades
constexpr double kBay = 4.0;         // [m] width of a bay
constexpr double kAlleyDepth = 7.0;  // [m]

Material stone(const char* name, float r, float g, float b, Material::Pattern pattern, float size) {
    Material m;
    m.name = name;
    m.colour = {r, g, b};
    m.noiseSize = 2.5F;
    m.pattern = pattern;
    m.patternSize = size;
    return m;
}

Material wallStone() {
    return stone("ashlar", 0.72F, 0.64F, 0.50F, Material::Pattern::kBricks, 0.9F);
}
Material darkStone() {
    return stone("niche", 0.55F, 0.50F, 0.42F, Material::Pattern::kNone, 0.5F);
}
Material paving() {
    return stone("paving", 0.52F, 0.50F, 0.47F, Material::Pattern::kTiles, 0.8F);
}

/// Facade frame: x along the wall, z up, the front looks to -y, so recesses go to +y.
struct Rectangle {
    double x0, x1, z0, z1;
};

void plate(MeshBuilder& b, const Rectangle& r, double y = 0) {
    b.quad({r.x0, y, r.z0}, {r.x1, y, r.z0}, {r.x1, y, r.z1}, {r.x0, y, r.z1});
}

/// The plate `r` with a rectangular opening.
void plateWithOpening(MeshBuilder& b, const Rectangle& r, const Rectangle& o) {
    plate(b, {r.x0, o.x0, r.z0, r.z1});
    plate(b, {o.x1, r.x1, r.z0, r.z1});
    plate(b, {o.x0, o.x1, o.z1, r.z1});
    if (o.z0 > r.z0) {
        plate(b, {o.x0, o.x1, r.z0, o.z0});
    }
}

/// A recessed window with a mullion.
void window(MeshBuilder& b, const Rectangle& bay, const Rectangle& o) {
    const double depth = 0.3;
    b.material(wallStone());
    plateWithOpening(b, bay, o);
    b.quad({o.x0, depth, o.z0}, {o.x0, depth, o.z1}, {o.x0, 0, o.z1}, {o.x0, 0, o.z0});
    b.quad({o.x1, 0, o.z1}, {o.x1, depth, o.z1}, {o.x1, depth, o.z0}, {o.x1, 0, o.z0});
    b.quad({o.x1, 0, o.z0}, {o.x1, depth, o.z0}, {o.x0, depth, o.z0}, {o.x0, 0, o.z0});
    b.quad({o.x0, depth, o.z1}, {o.x1, depth, o.z1}, {o.x1, 0, o.z1}, {o.x0, 0, o.z1});
    b.material(darkStone());
    plate(b, o, depth);
    b.material(wallStone());
    const double middle = (o.x0 + o.x1) / 2;
    b.box({middle - 0.06, depth - 0.12, o.z0}, {middle + 0.06, depth, o.z1}, kMinX | kMaxX | kMinY);
}

/// A niche under a round arch; the springing line at `spring`.
void arch(MeshBuilder& b, const Rectangle& bay, double halfWidth, double spring, double depth) {
    const double middle = (bay.x0 + bay.x1) / 2;
    const double l = middle - halfWidth;
    const double r = middle + halfWidth;
    b.material(wallStone());
    plate(b, {bay.x0, l, bay.z0, bay.z1});
    plate(b, {r, bay.x1, bay.z0, bay.z1});
    constexpr int kSteps = 20;
    const auto rim = [&](int i) {
        const double angle = std::numbers::pi * (1 - static_cast<double>(i) / kSteps);
        return Eigen::Vector2d(middle + halfWidth * std::cos(angle),
                               spring + halfWidth * std::sin(angle));
    };
    for (int i = 0; i < kSteps; ++i) {
        const Eigen::Vector2d p = rim(i);
        const Eigen::Vector2d q = rim(i + 1);
        b.material(wallStone());
        b.quad({p.x(), 0, p.y()}, {q.x(), 0, q.y()}, {q.x(), 0, bay.z1}, {p.x(), 0, bay.z1});
        b.quad({p.x(), 0, p.y()}, {p.x(), depth, p.y()}, {q.x(), depth, q.y()}, {q.x(), 0, q.y()});
        b.material(darkStone());
        b.triangle({middle, depth, spring}, {q.x(), depth, q.y()}, {p.x(), depth, p.y()});
    }
    b.material(darkStone());
    plate(b, {l, r, bay.z0, spring}, depth);
    b.quad({l, depth, bay.z0}, {l, depth, spring}, {l, 0, spring}, {l, 0, bay.z0});
    b.quad({r, 0, spring}, {r, depth, spring}, {r, depth, bay.z0}, {r, 0, bay.z0});
    b.material(paving());
    b.quad({r, 0, bay.z0}, {r, depth, bay.z0}, {l, depth, bay.z0}, {l, 0, bay.z0});
}

/// A gap up to the roof with a dead end.
void alley(MeshBuilder& b, const Rectangle& bay) {
    const double l = bay.x0;
    const double r = bay.x1;
    const double depth = kAlleyDepth;
    b.material(wallStone());
    b.quad({l, depth, 0}, {l, depth, kHeight}, {l, 0, kHeight}, {l, 0, 0});
    b.quad({r, 0, kHeight}, {r, depth, kHeight}, {r, depth, 0}, {r, 0, 0});
    b.material(darkStone());
    plate(b, bay, depth);
    b.material(paving());
    b.quad({r, 0, 0}, {r, depth, 0}, {l, depth, 0}, {l, 0, 0});
}

/// One letter a bay: w windows, a arch below and window above, n narrow arch, | alley.
void facade(MeshBuilder& b, const Point& origin, double yaw, const std::string& bays) {
    for (std::size_t i = 0; i < bays.size(); ++i) {
        const Rectangle bay{kBay * static_cast<double>(i), kBay * static_cast<double>(i + 1), 0,
                            kHeight};
        const double middle = (bay.x0 + bay.x1) / 2;
        b.frame(origin, yaw);
        if (bays[i] == '|') {
            alley(b, bay);
            continue;
        }
        const Rectangle ground{bay.x0, bay.x1, 0, 4.6};
        const Rectangle upper{bay.x0, bay.x1, 4.6, kHeight};
        if (bays[i] == 'a') {
            arch(b, ground, 1.35, 2.4, 1.6);
        } else if (bays[i] == 'n') {
            arch(b, ground, 0.7, 2.2, 0.6);
        } else {
            window(b, ground, {middle - 0.7, middle + 0.7, 1.0, 3.2});
        }
        window(b, upper, {middle - 0.6, middle + 0.6, 5.4, 7.6});
        // A string course between the storeys.
        b.material(wallStone());
        b.box({bay.x0, -0.12, 4.5}, {bay.x1, 0, 4.7}, kMinY | kBottom | kTop);
    }
}

void addFountain(MeshBuilder& b, const Point& centre) {
    b.frame({0, 0, 0});
    b.material(stone("fountain", 0.62F, 0.60F, 0.56F, Material::Pattern::kNone, 0.5F));
    b.lathe(centre,
            {{2.0, 0.0},
             {2.0, 0.6},
             {1.75, 0.6},
             {1.75, 0.25},
             {0.35, 0.25},
             {0.30, 1.3},
             {0.9, 1.55},
             {0.9, 1.65},
             {0.25, 1.5},
             {0.16, 2.4},
             {0.0, 2.6}},
            48);
}

void addBench(MeshBuilder& b, const Point& origin, double yaw) {
    b.frame(origin, yaw);
    b.material(stone("bench", 0.50F, 0.38F, 0.26F, Material::Pattern::kNone, 0.5F));
    b.box({-0.9, -0.22, 0.40}, {0.9, 0.22, 0.48});
    b.box({-0.8, -0.18, 0}, {-0.65, 0.18, 0.40}, kAllFaces & ~(kBottom | kTop));
    b.box({0.65, -0.18, 0}, {0.8, 0.18, 0.40}, kAllFaces & ~(kBottom | kTop));
}

}  // namespace

World makeCourtyard() {
    constexpr double kX = 20;  // half the yard
    constexpr double kY = 18;
    MeshBuilder b;
    b.material(paving());
    b.quad({-kX, -kY, 0}, {kX, -kY, 0}, {kX, kY, 0}, {-kX, kY, 0});
    const double quarter = std::numbers::pi / 2;
    facade(b, {-kX, kY, 0}, 0, "waawaawa|w");                 // north, seen from the south
    facade(b, {kX, -kY, 0}, std::numbers::pi, "wnw|wnaanw");  // south
    facade(b, {kX, kY, 0}, -quarter, "waanwnaaw");            // east
    facade(b, {-kX, -kY, 0}, quarter, "wnaw|wanw");           // west

    Material lawn = stone("lawn", 0.34F, 0.46F, 0.24F, Material::Pattern::kNone, 0.5F);
    lawn.noise = 1.3F;
    b.frame({0, 0, 0});
    for (const double sx : {-1.0, 1.0}) {  // four lawns, a hand's breadth above the paving
        for (const double sy : {-1.0, 1.0}) {
            const double x0 = sx > 0 ? 1.5 : -13.5;
            const double y0 = sy > 0 ? 1.5 : -11.5;
            b.material(lawn);
            b.box({x0, y0, 0}, {x0 + 12, y0 + 10, 0.12}, kOnFloor);
        }
    }
    addFountain(b, {0, 0, 0});
    addBench(b, {-8, -13.4, 0}, 0.05);
    addBench(b, {6, 13.6, 0}, std::numbers::pi);
    addBench(b, {15.2, 3, 0}, quarter);
    b.frame({0, 0, 0});
    b.material(stone("column", 0.70F, 0.66F, 0.58F, Material::Pattern::kNone, 0.5F));
    for (const double x : {-16.5, 16.5}) {
        b.cylinder({x, -14.5, 0}, 0.3, 4.0, 32, kOnFloor);
        b.sphere({x, -14.5, 4.3}, 0.45, 32);
    }

    World world;
    world.name = "courtyard";
    world.mesh = b.take();
    world.workspace = {{-kX, -kY, 0.0}, {kX, kY, 6.0}};
    world.starts = {StartPose::towards({-4, -14.5, 1.2}, {8, -18, 2}),
                    StartPose::towards({15, 13, 1.2}, {20, 5, 2}),
                    StartPose::towards({-15.5, 6, 1.2}, {-20, 12, 2})};
    return world;
}

}  // namespace riftmap
