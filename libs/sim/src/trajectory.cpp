// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/trajectory.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "random_bits.h"

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::int64_t kFirstTime = 1'700'000'000'000'000'000;  // [ns]

std::string text(const Point& p) {
    char buffer[80];
    std::snprintf(buffer, sizeof(buffer), "(%.3f, %.3f, %.3f)", p.x(), p.y(), p.z());
    return buffer;
}

/// A building is worth looking at from inside: its workspace lies within its surface.
bool isBuilding(const World& world) {
    const Bounds surface = bounds(world.mesh);
    return (world.workspace.size().head<2>().array() <= surface.size().head<2>().array() + 1e-6)
        .all();
}

/// Radius of a circle round this place that touches nothing.
double freeRadius(const World& world, const RayCaster& caster, const Point& centre,
                  double clearance) {
    const double wanted = 0.2 * world.workspace.size().head<2>().minCoeff();
    const auto nearest = caster.closest(centre, wanted + clearance);
    return nearest ? std::max(0.0, 0.9 * (nearest->distance - clearance)) : wanted;
}

std::vector<Pose> orbit(const TrajectoryOptions& o, const World& world, const RayCaster& caster) {
    const bool building = isBuilding(world);
    const Bounds surface = bounds(world.mesh);
    Point centre = building ? world.workspace.centre() : surface.centre();
    if (o.centre.size() == 3) {
        centre = {o.centre[0], o.centre[1], o.centre[2]};
    } else if (!o.centre.empty()) {
        throw ConfigError("Trajectory.centre: three numbers x y z are needed, " +
                          std::to_string(o.centre.size()) + " given");
    }
    double radius = o.radius;
    if (radius == 0) {
        radius = building ? freeRadius(world, caster, centre, o.clearance)
                          : surface.size().head<2>().norm() / 2 + 1.0;
    }
    const bool outward = o.look == TrajectoryOptions::Look::kOutward ||
                         (o.look == TrajectoryOptions::Look::kAuto && building);
    std::vector<Pose> poses;
    for (int i = 0; i < o.views; ++i) {
        const double angle = 2 * std::numbers::pi * i / o.views;
        const Point eye = centre + radius * Point(std::cos(angle), std::sin(angle), 0);
        poses.push_back(outward ? StartPose{eye, angle, o.pitch}.pose() : lookAt(eye, centre));
    }
    return poses;
}

std::vector<Pose> lawnmower(const TrajectoryOptions& o, const World& world,
                            const RayCaster& caster) {
    const Bounds& box = world.workspace;
    const Point size = box.size();
    const auto stops = [&](double length) {
        return std::max(1, static_cast<int>(std::floor(length / o.spacing + 0.5)));
    };
    const int columns = stops(size.x());
    const int rows = stops(size.y());
    std::vector<Pose> poses;
    for (int r = 0; r < rows; ++r) {
        for (int k = 0; k < columns; ++k) {
            const int c = r % 2 == 0 ? k : columns - 1 - k;
            const Point eye = box.min + Point(size.x() * (c + 0.5) / columns,
                                              size.y() * (r + 0.5) / rows, o.height);
            if (caster.closest(eye, o.clearance)) {
                continue;
            }
            for (int d = 0; d < o.directions; ++d) {
                const double yaw = 2 * std::numbers::pi * d / o.directions;
                poses.push_back(StartPose{eye, yaw, o.pitch}.pose());
            }
        }
    }
    return poses;
}

std::vector<Pose> waypoints(const TrajectoryOptions& o) {
    if (o.waypoints.size() < 5 || o.waypoints.size() % 5 != 0) {
        throw ConfigError("Trajectory.waypoints: five numbers a pose (x y z yaw_deg pitch_deg), " +
                          std::to_string(o.waypoints.size()) + " given");
    }
    std::vector<Pose> given;
    for (std::size_t i = 0; i < o.waypoints.size(); i += 5) {
        const double* w = &o.waypoints[i];
        given.push_back(StartPose{{w[0], w[1], w[2]}, w[3] * kDegree, w[4] * kDegree}.pose());
    }
    if (given.size() == 1) {
        return given;
    }
    std::vector<Pose> poses;
    for (int i = 0; i < o.views; ++i) {
        const double s = o.views == 1 ? 0.0
                                      : static_cast<double>(i) / (o.views - 1) *
                                            static_cast<double>(given.size() - 1);
        const std::size_t leg = std::min(static_cast<std::size_t>(s), given.size() - 2);
        poses.push_back(interpolate(given[leg], given[leg + 1], s - static_cast<double>(leg)));
    }
    return poses;
}

std::vector<TimedPose> timed(const std::vector<Pose>& poses, double rate) {
    std::vector<TimedPose> result;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        // Whole microseconds: exact in MRPT's clock too.
        const auto microseconds = std::llround(static_cast<double>(i) / rate * 1e6);
        result.push_back({kFirstTime + microseconds * 1000, poses[i]});
    }
    return result;
}

void checkInside(const std::vector<TimedPose>& trajectory, const Bounds& workspace) {
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
        const Point& p = trajectory[i].pose.translation;
        if (!workspace.contains(p)) {
            throw ConfigError("Trajectory: view " + std::to_string(i) + " at " + text(p) +
                              " lies outside the world's workspace " + text(workspace.min) +
                              " .. " + text(workspace.max));
        }
    }
}

void checkClear(const std::vector<TimedPose>& trajectory, const RayCaster& caster,
                double clearance) {
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
        const Point& p = trajectory[i].pose.translation;
        if (const auto nearest = caster.closest(p, clearance)) {
            char distance[32];
            std::snprintf(distance, sizeof(distance), "%.3g", nearest->distance);
            throw ConfigError("Trajectory: view " + std::to_string(i) + " at " + text(p) + " is " +
                              distance + " m from a surface; Trajectory.clearance asks for more");
        }
    }
}

Point gaussianVector(std::uint64_t seed, std::uint64_t index) {
    return {static_cast<double>(gaussian(seed, 3 * index)),
            static_cast<double>(gaussian(seed, 3 * index + 1)),
            static_cast<double>(gaussian(seed, 3 * index + 2))};
}

Eigen::Matrix3d rotationBy(const Point& vector) {
    const double angle = vector.norm();
    if (angle == 0) {
        return Eigen::Matrix3d::Identity();
    }
    return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

}  // namespace

void TrajectoryOptions::describe(OptionTable& table) {
    table.section("Trajectory", "Where the simulated camera is carried.");
    table.addChoice("kind", kind,
                    {{"orbit", Kind::kOrbit},
                     {"lawnmower", Kind::kLawnmower},
                     {"waypoints", Kind::kWaypoints},
                     {"tum", Kind::kTum}},
                    "A circle, rows of stops over the workspace, a polygon, or a file.");
    table.add("file", file, "TUM file (t x y z qx qy qz qw of the left optical frame), kind tum.");
    table.add("views", views, 1, 1000000, "", "Views of an orbit or over all waypoints.");
    table.add("centre", centre, 0, "m", "Middle of the orbit x y z; empty: that of the world.");
    table.add("radius", radius, 0, 1000, "m", "Of the orbit; 0: from the size of the world.");
    table.addChoice(
        "look", look,
        {{"auto", Look::kAuto}, {"inward", Look::kInward}, {"outward", Look::kOutward}},
        "Which way an orbit looks; auto: inward round an object, outward in a building.");
    table.addDegrees("pitch_deg", pitch, -90, 90,
                     "View above the horizon, outward orbit and lawn-mower.");
    table.add("spacing", spacing, 0.01, 1000, "m", "Between stops and rows of the lawn-mower.");
    table.add("height", height, 0, 1000, "m",
              "Of the lawn-mower above the floor of the workspace.");
    table.add("directions", directions, 1, 64, "",
              "Views at each stop of the lawn-mower, evenly round.");
    table.add("waypoints", waypoints, 0, "", "x y z yaw_deg pitch_deg, five numbers a pose.");
    table.add("clearance", clearance, 0, 100, "m", "Least distance of a view from any surface.");
    table.add("rate", rate, 0.001, 10000, "Hz", "Views a second, for the timestamps.");
}

std::vector<TimedPose> makeTrajectory(const TrajectoryOptions& o, const World& world,
                                      const RayCaster& caster) {
    std::vector<TimedPose> trajectory;
    switch (o.kind) {
        case TrajectoryOptions::Kind::kOrbit:
            trajectory = timed(orbit(o, world, caster), o.rate);
            break;
        case TrajectoryOptions::Kind::kLawnmower:
            trajectory = timed(lawnmower(o, world, caster), o.rate);
            break;
        case TrajectoryOptions::Kind::kWaypoints:
            trajectory = timed(waypoints(o), o.rate);
            break;
        case TrajectoryOptions::Kind::kTum:
            if (o.file.empty()) {
                throw ConfigError("Trajectory.file: kind tum needs a file");
            }
            trajectory = readTum(o.file);
            break;
    }
    if (trajectory.empty()) {
        throw ConfigError(
            "Trajectory: no view is left (nowhere clear of the surface, or an empty file)");
    }
    if (o.kind != TrajectoryOptions::Kind::kTum) {  // a recorded path may lead anywhere
        checkInside(trajectory, world.workspace);
    }
    checkClear(trajectory, caster, o.clearance);
    return trajectory;
}

void PoseNoiseOptions::describe(OptionTable& table) {
    table.section("PoseNoise", "Errors of the recorded poses; the truth is written beside them.");
    table.add("position", position, 0, 10, "m", "Standard deviation of each coordinate, a view.");
    table.addDegrees("rotation_deg", rotation, 0, 180,
                     "Standard deviation about each axis, a view.");
    table.add("position_drift", positionDrift, 0, 10, "m",
              "Random walk of each coordinate: standard deviation after one metre.");
    table.addDegrees("rotation_drift_deg", rotationDrift, 0, 180,
                     "Random walk about each axis: standard deviation after one metre.");
}

std::vector<TimedPose> withPoseNoise(const std::vector<TimedPose>& truth, const PoseNoiseOptions& o,
                                     std::uint64_t seed) {
    std::vector<TimedPose> believed = truth;
    if (!o.any()) {
        return believed;
    }
    Pose drifted = truth.empty() ? Pose() : truth.front().pose;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (i > 0) {
            const Pose& before = truth[i - 1].pose;
            Pose step = before.inverse() * truth[i].pose;
            const double walk = std::sqrt(step.translation.norm());
            step.translation += walk * o.positionDrift * gaussianVector(mixBits(seed, 1), i);
            step.rotation = step.rotation * rotationBy(walk * o.rotationDrift *
                                                       gaussianVector(mixBits(seed, 2), i));
            drifted = drifted * step;
            drifted.rotation = Eigen::Quaterniond(drifted.rotation).normalized().toRotationMatrix();
        }
        Pose& pose = believed[i].pose;
        pose = drifted;
        pose.translation += o.position * gaussianVector(mixBits(seed, 3), i);
        pose.rotation =
            pose.rotation * rotationBy(o.rotation * gaussianVector(mixBits(seed, 4), i));
    }
    return believed;
}

}  // namespace riftmap
