// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/thin_shells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "planner_scene.h"
#include "riftmap/planner/view_planner.h"

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;

/// Distance to the faces of a box without a lid, along a ray.
void hitPot(const Eigen::AlignedBox3d& box, const Point& origin, const Point& ray,
            std::optional<double>& nearest) {
    for (int axis = 0; axis < 3; ++axis) {
        for (const bool high : {false, true}) {
            if (axis == 2 && high) {
                continue;
            }
            const double plane = high ? box.max()[axis] : box.min()[axis];
            const double t = (plane - origin[axis]) / ray[axis];
            const Point p = origin + t * ray;
            bool inside = t > 1e-9;
            for (int other = 0; other < 3; ++other) {
                inside = inside && (other == axis ||
                                    (p[other] >= box.min()[other] && p[other] <= box.max()[other]));
            }
            if (inside && (!nearest || t < *nearest)) {
                nearest = t;
            }
        }
    }
}

/// Three sides and the bottom of a pot, and aslant from above, so that a part of its inside is not
/// seen.
const std::vector<Point> kThreeSides = {Point(-1.5, 0, 0.1), Point(0, -1.5, 0.1),
                                        Point(1.5, 0, 0.1), Point(0, 0.05, -1.5),
                                        Point(-0.9, 0, 1.1)};

std::vector<Point> allSides() {
    std::vector<Point> sides = kThreeSides;
    sides.emplace_back(0, 1.5, 0.1);
    return sides;
}

/// A pot with walls of some thickness (0: none), and what was seen of it.
class Pot {
 public:
    /// `board`: a small one stands before the side of larger y, 0.35 m away.
    explicit Pot(double wall, const std::vector<Point>& eyes = allSides(), bool board = false)
        : wall_(wall), board_(board) {
        for (const Point& eye : eyes) {
            const View view = test::viewOf(
                lookAt(eye, Point::Zero()),
                [this](const Point& origin, const Point& ray) { return hit(origin, ray); });
            graph_.merge(view);
            knowledge_.update(view);
        }
    }
    std::vector<FreeSpace::Frontier> frontier() const {
        return knowledge_.unseen().frontier(*knowledge_.surfaceBox());
    }
    ThinShells shells() const { return {knowledge_.unseen(), knowledge_.summary(), frontier()}; }
    bool isInside(const Point& p) const {
        return std::max(std::abs(p.x()), std::abs(p.y())) < kHalf - wall_ && p.z() > wall_ - kHalf;
    }
    /// In a wall, or within two voxels of its rim.
    bool isInWall(const Point& p) const {
        const double side = std::max(std::abs(p.x()), std::abs(p.y()));
        return side > kHalf - wall_ && side < kHalf + 0.11 && std::abs(p.z()) < kHalf + 0.11;
    }

 private:
    static constexpr double kHalf = 0.4;

    std::optional<double> hit(const Point& origin, const Point& ray) const {
        std::optional<double> nearest;
        const Point half(kHalf, kHalf, kHalf);
        hitPot({-half, half}, origin, ray, nearest);
        if (board_) {
            hitPot({Point(-0.06, 0.75, -0.11), Point(0.06, 0.76, 0.01)}, origin, ray, nearest);
        }
        if (wall_ > 0) {
            const Point within(wall_, wall_, 0);
            hitPot({-half + Point(wall_, wall_, wall_), half - within}, origin, ray, nearest);
        }
        return nearest;
    }
    static GraphOptions graphOptions() {
        GraphOptions o;
        o.targetResolution = 0.01;
        return o;
    }
    static PlatformLimits limits() {
        PlatformLimits limits;
        limits.boxMin = Point(-2, -2, -2);
        limits.boxMax = Point(2, 2, 2);
        limits.farLimit = 6;
        return limits;
    }
    static PlannerOptions options() {
        PlannerOptions o;
        o.surfaceBox = {-0.5, -0.5, -0.5, 0.5, 0.5, 0.5};
        o.backgroundIsFree = true;
        return o;
    }

    double wall_;
    bool board_;
    PixelGraph graph_{graphOptions()};
    Knowledge knowledge_{graph_, limits(), options()};
};

TEST(ThinShells, holdTheInsideOfAPotWithWallsOfNoThickness) {
    const Pot pot(0.0);
    const ThinShells shells = pot.shells();
    std::size_t held = 0;
    std::size_t inside = 0;
    for (const FreeSpace::Frontier& place : pot.frontier()) {
        const bool in = pot.isInside(place.centre.cast<double>());
        inside += in ? 1 : 0;
        held += shells.hold(place) ? 1 : 0;
        EXPECT_TRUE(in || !shells.hold(place)) << place.centre.transpose();
        EXPECT_TRUE(!shells.hold(place) || shells.touch(place.centre.cast<double>()));
    }
    ASSERT_GT(inside, 100U) << "the test needs a part of the inside that was not seen";
    EXPECT_GT(held, inside * 9 / 10);
    EXPECT_FALSE(shells.touch({0, 0, 1}));
}

struct Counts {
    std::size_t before = 0, heldBefore = 0;  ///< before the side of larger y
    std::size_t held = 0;
};

/// Places of the frontier beyond `y`, and within `half` of the side's middle.
Counts countBefore(const Pot& pot, double y, double half) {
    const ThinShells shells = pot.shells();
    Counts n;
    for (const FreeSpace::Frontier& place : pot.frontier()) {
        const Point p = place.centre.cast<double>();
        const bool isBefore = p.y() > y && std::abs(p.x()) < half && std::abs(p.z()) < half;
        n.before += isBefore ? 1 : 0;
        n.held += shells.hold(place) ? 1 : 0;
        n.heldBefore += isBefore && shells.hold(place) ? 1 : 0;
    }
    return n;
}

TEST(ThinShells, doNotHoldASideThatWasNotSeenThoughTheInsideLiesBehindIt) {
    const Pot pot(0.0, kThreeSides);
    const auto [before, heldBefore, held] = countBefore(pot, 0.45, 0.35);
    EXPECT_EQ(heldBefore, 0U);
    EXPECT_GT(before, 30U);
    EXPECT_GT(held, 50U) << "the test needs an inside that is held";
}

TEST(ThinShells, doNotHoldAPatchThatWasNotSeenAmongWhatWas) {
    std::vector<Point> eyes = allSides();
    eyes.emplace_back(0, -1.5, 0.8);  // over the rim, to just above the patch
    const Pot pot(0.0, eyes, true);
    const auto [before, heldBefore, held] = countBefore(pot, 0.43, 0.3);
    EXPECT_EQ(heldBefore, 0U) << "of " << before;
    EXPECT_GT(before, 10U);
    EXPECT_GT(held, 50U) << "the test needs an inside that is held";
}

TEST(ThinShells, areNoneWhereWallsAreThick) {
    const Pot pot(0.1);
    const ThinShells shells = pot.shells();
    std::size_t inside = 0;
    std::size_t within = 0;  // the walls themselves: nothing is to be seen there
    for (const FreeSpace::Frontier& place : pot.frontier()) {
        const bool in = pot.isInside(place.centre.cast<double>());
        inside += in ? 1 : 0;
        EXPECT_FALSE(!pot.isInWall(place.centre.cast<double>()) && shells.hold(place))
            << place.centre.transpose();
        within += shells.hold(place) ? 1 : 0;
    }
    EXPECT_LT(within, inside / 4);
    ASSERT_GT(inside, 100U) << "the test needs a part of the inside that was not seen";
}

}  // namespace
}  // namespace riftmap
