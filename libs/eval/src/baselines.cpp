// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/baselines.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "baseline_tools.h"

namespace riftmap {

namespace {

constexpr double kPi = 3.141592653589793;
constexpr double kGoldenAngle = 2.399963229728653;

/// Distance from which a ball of this radius round `centre` fills the smaller side of the image,
/// kept within the range and within the workspace.
double fittingDistance(const BaselineState& state, const Eigen::Vector3d& centre, double radius) {
    const StereoCamera& c = state.camera;
    const double half = std::min(std::atan(c.width / (2 * c.fx)), std::atan(c.height / (2 * c.fy)));
    const double near = state.limits.nearLimit + radius;
    const double fits =
        std::clamp(radius / std::sin(half), near, std::max(state.limits.farLimit - radius, near));
    const double room = std::min((centre - state.limits.boxMin).minCoeff(),
                                 (state.limits.boxMax - centre).minCoeff());
    return room > radius ? std::min(fits, room) : fits;
}

class RandomViews : public ViewSource {
 public:
    RandomViews(const Eigen::AlignedBox3d& target, std::uint64_t seed)
        : target_(target), random_(seed) {}

    std::optional<std::vector<Pose>> next(const BaselineState& state) override {
        for (int attempt = 0; attempt < 200; ++attempt) {
            const Eigen::Vector3d place = randomIn(workspace(state.limits), random_);
            const Eigen::Vector3d direction =
                target_.isEmpty() ? randomDirection(random_)
                                  : Eigen::Vector3d(randomIn(target_, random_) - place);
            if (auto path = pathTo(state, viewOf(state.limits, place, direction), 4000)) {
                return path;
            }
        }
        return std::nullopt;
    }

 private:
    Eigen::AlignedBox3d target_;
    std::mt19937_64 random_;
};

/// Views planned at the first call, then visited one after the other; those that cannot be reached
/// are left out.
class PlannedViews : public ViewSource {
 public:
    std::optional<std::vector<Pose>> next(const BaselineState& state) override {
        if (!planned_) {
            views_ = plan(state);
            planned_ = true;
        }
        while (at_ < views_.size()) {
            if (auto path = way(state, views_[at_++])) {
                return path;
            }
        }
        return std::nullopt;
    }

 protected:
    virtual std::vector<Pose> plan(const BaselineState& state) = 0;
    virtual std::optional<std::vector<Pose>> way(const BaselineState& state, const Pose& view) {
        return pathTo(state, view, 20000);
    }

 private:
    bool planned_ = false;
    std::vector<Pose> views_;
    std::size_t at_ = 0;
};

class LawnMower : public PlannedViews {
 public:
    explicit LawnMower(double spacing) : spacing_(spacing) {}

 protected:
    std::vector<Pose> plan(const BaselineState& state) override {
        const Eigen::AlignedBox3d box = workspace(state.limits);
        const auto stops = [&](int axis) {
            const double side = box.sizes()[axis];
            const int n = std::max(1, static_cast<int>(std::ceil(side / spacing_)));
            std::vector<double> at;
            for (int i = 0; i < n; ++i) {
                at.push_back(box.min()[axis] + side * (i + 0.5) / n);
            }
            return at;
        };
        std::vector<Pose> views;
        bool back = false;
        const double z = box.center().z();
        for (const double y : stops(1)) {
            std::vector<double> row = stops(0);
            if (back) {
                std::reverse(row.begin(), row.end());
            }
            back = !back;
            for (const double x : row) {
                for (const Eigen::Vector3d& d :
                     {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(-1, 0, 0),
                      Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0.3, 0, -1),
                      Eigen::Vector3d(0.3, 0, 1)}) {
                    views.push_back(viewOf(state.limits, {x, y, z}, d));
                }
            }
        }
        return views;
    }

 private:
    double spacing_;
};

class Orbit : public PlannedViews {
 public:
    Orbit(const BaselineOptions& options, const Eigen::AlignedBox3d& target)
        : options_(options), target_(target) {}

 protected:
    std::vector<Pose> plan(const BaselineState& state) override {
        const Eigen::AlignedBox3d box = workspace(state.limits);
        const bool inside = target_.isEmpty();
        const Eigen::Vector3d centre = inside ? box.center() : target_.center();
        double radius = options_.radius;
        if (radius <= 0) {
            radius = inside ? box.sizes().head<2>().minCoeff() / 4
                            : fittingDistance(state, centre, target_.sizes().norm() / 2);
        }
        const int count = options_.views > 0 ? options_.views : 24;
        const int rings = std::min(3, count);
        std::vector<Pose> views;
        for (int ring = 0; ring < rings; ++ring) {
            const double elevation = rings == 1 ? 0.0 : (ring - 1) * kPi / 5;
            const int n = count / rings + (ring < count % rings ? 1 : 0);
            for (int i = 0; i < n; ++i) {
                const double angle = 2 * kPi * i / n;
                const Eigen::Vector3d out(std::cos(angle) * std::cos(elevation),
                                          std::sin(angle) * std::cos(elevation),
                                          std::sin(elevation));
                if (inside) {  // level circle, looking outwards, down and up
                    const Eigen::Vector3d place =
                        centre + radius * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
                    views.push_back(viewOf(state.limits, place, out));
                } else {
                    views.push_back(viewOf(state.limits, centre + radius * out, -out));
                }
            }
        }
        return views;
    }

 private:
    BaselineOptions options_;
    Eigen::AlignedBox3d target_;
};

class Sphere : public PlannedViews {
 public:
    Sphere(const BaselineOptions& options, const Eigen::AlignedBox3d& target)
        : count_(options.views > 0 ? options.views : 10),
          radius_(options.radius),
          centre_(target.center()),
          targetRadius_(target.sizes().norm() / 2) {}

 protected:
    std::vector<Pose> plan(const BaselineState& state) override {
        if (radius_ <= 0) {
            radius_ = fittingDistance(state, centre_, targetRadius_);
        }
        std::vector<Eigen::Vector3d> places;
        for (int i = 0; i < count_; ++i) {
            const double z = 1 - (2 * i + 1) / static_cast<double>(count_);
            const double r = std::sqrt(1 - z * z);
            const double a = kGoldenAngle * i;
            places.emplace_back(centre_ +
                                radius_ * Eigen::Vector3d(r * std::cos(a), r * std::sin(a), z));
        }
        std::vector<Pose> views;
        for (const Eigen::Vector3d& p : shortTour(state.pose.translation, places)) {
            views.push_back(viewOf(state.limits, p, centre_ - p));
        }
        return views;
    }

    /// Round the target, not through it.
    std::optional<std::vector<Pose>> way(const BaselineState& state, const Pose& view) override {
        const Eigen::Vector3d a = state.pose.translation - centre_;
        const Eigen::Vector3d b = view.translation - centre_;
        const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
        const int steps = std::max(1, static_cast<int>(std::ceil(angle / 0.35)));
        std::vector<Pose> path;
        Eigen::Vector3d here = state.pose.translation;
        for (int i = 1; i <= steps; ++i) {
            const double s = i / static_cast<double>(steps);
            const Eigen::Vector3d place = centre_ + between(a, b, angle, s);
            if (!state.segmentClear(here, place)) {
                return PlannedViews::way(state, view);
            }
            path.push_back(viewOf(state.limits, place, centre_ - place));
            here = place;
        }
        path.back() = view;
        if (pathLength(state.pose, path) > state.limits.maxStep) {
            return std::nullopt;
        }
        return path;
    }

 private:
    /// From a to b along the great circle, the distance from the centre changing evenly.
    static Eigen::Vector3d between(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double angle,
                                   double s) {
        if (s >= 1) {
            return b;
        }
        const double radius = (1 - s) * a.norm() + s * b.norm();
        Eigen::Vector3d across = b.normalized() - a.normalized() * std::cos(angle);
        if (across.norm() < 1e-9) {
            across = a.unitOrthogonal();
        }
        return radius *
               (a.normalized() * std::cos(s * angle) + across.normalized() * std::sin(s * angle));
    }

    int count_;
    double radius_;
    Eigen::Vector3d centre_;
    double targetRadius_;
};

}  // namespace

void BaselineOptions::describe(OptionTable& table) {
    table.section("Baseline", "View sources to compare the planner with.");
    table.add("views", views, 0, 100000, "views", "Of orbit and sphere; 0: 24 and 10.");
    table.add("radius", radius, 0.0, 1000.0, "m",
              "Of orbit and sphere; 0: so that the target fills the image.");
    table.add("spacing", spacing, 0.1, 100.0, "m", "Between the stops of the lawn-mower.");
    table.add("resolution", resolution, 0.0, 10.0, "m",
              "Of octomap_frontier's map; 0: 10 cm, for an object 1/25 of its side.");
    table.add("min_gain", minGain, 0.0, 1.0, "",
              "octomap_frontier ends when its best view would show less than this share of the "
              "frontier voxels that would fill an image.");
    table.add("poses", poses, 1, 1000000, "", "Random poses that foresight picks its views from.");
}

const std::vector<std::string>& baselineNames() {
    static const std::vector<std::string> names{"random", "orbit", "lawnmower", "sphere",
                                                "octomap_frontier"};
    return names;
}

std::unique_ptr<ViewSource> makeBaseline(const std::string& name, const BaselineOptions& options,
                                         const Eigen::AlignedBox3d& target, std::uint64_t seed) {
    if (name == "random") {
        return std::make_unique<RandomViews>(target, seed);
    }
    if (name == "orbit") {
        return std::make_unique<Orbit>(options, target);
    }
    if (name == "lawnmower") {
        return std::make_unique<LawnMower>(options.spacing);
    }
    if (name == "sphere") {
        if (target.isEmpty()) {
            throw std::invalid_argument("the baseline sphere needs an object to look at");
        }
        return std::make_unique<Sphere>(options, target);
    }
    if (name == "octomap_frontier") {
        return makeOctomapFrontier(options, target, seed);
    }
    throw std::invalid_argument("unknown baseline '" + name +
                                "'; allowed: random, orbit, lawnmower, sphere, octomap_frontier");
}

}  // namespace riftmap
