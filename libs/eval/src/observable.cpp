// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/observable.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "hash.h"
#include "observable_cache.h"
#include "riftmap/core/parallel.h"
#include "riftmap/eval/point_index.h"

namespace riftmap {

namespace {

constexpr std::uint32_t kMethodVersion = 4;

/// Most samples are seen along one of a few lines of sight. Deep inside what is hidden a moderate
/// fan will do, for each sample's fan is turned differently; the finest one is for the rim of what
/// is seen, where narrow views begin.
struct Round {
    int directions;
    bool onlyBesideSeen;
};

/// `spacing` [m] of the samples: the sparser they are the less they help each other.
std::array<Round, 3> roundsOf(int directions, double spacing) {
    const double sparser = std::max(1.0, spacing * spacing / 1e-4);  // than one a cm^2
    const int moderate = static_cast<int>(std::min<double>(directions, sparser * directions / 8));
    return {{{std::min(64, directions), false}, {moderate, false}, {directions, true}}};
}

constexpr std::size_t kMostNeighbours = 24;
constexpr double kGoldenAngle = 2.399963229728653;

/// A position that sees a sample, and on which side of its triangle it lies.
struct Sight {
    Eigen::Vector3f eye = Eigen::Vector3f::Zero();
    std::int8_t side = 0;  ///< +1 the triangle's normal, -1 against it, 0 not seen
};

double spacingOf(const SurfaceSamples& samples) {
    return std::sqrt(samples.area / static_cast<double>(samples.points.size()));
}

/// Ray origins lie this far off the surface [m]: far more than a float's rounding, far less than
/// any distance that matters.
double surfaceOffset(const SurfaceSamples& samples) {
    float largest = 0;
    for (const auto& p : samples.points) {
        largest = std::max(largest, p.cwiseAbs().maxCoeff());
    }
    return std::clamp(1e-5 * static_cast<double>(largest), 2e-5, 1e-3);
}

/// Random phase of a sample's fan of directions, in [0, 1).
double phase(std::size_t sample, std::uint64_t round) {
    Fnv hash;
    hash.add(static_cast<std::uint64_t>(sample));
    hash.add(round);
    return static_cast<double>(hash.value() >> 11) * 0x1p-53;
}

class SightFinder {
 public:
    SightFinder(const RayCaster& caster, const ViewSpace& space, const ReachableSpace& reachable,
                const SurfaceSamples& samples, double maxIncidence)
        : caster_(caster),
          space_(space),
          reachable_(reachable),
          samples_(samples),
          cosLimit_(std::cos(maxIncidence)),
          lowest_(sineOf(space.minElevation)),
          highest_(sineOf(space.maxElevation)),
          offset_(surfaceOffset(samples)) {}

    /// Points around a circle, each the golden angle on from the one before.
    static std::vector<Eigen::Vector2d> goldenCircle(int count) {
        std::vector<Eigen::Vector2d> points;
        points.reserve(static_cast<std::size_t>(count));
        for (int k = 0; k < count; ++k) {
            points.emplace_back(std::cos(kGoldenAngle * k), std::sin(kGoldenAngle * k));
        }
        return points;
    }

    /// Looks outwards along a fan of directions a side, one for each point of goldenCircle().
    Sight lookOut(std::size_t sample, const std::vector<Eigen::Vector2d>& circle) const {
        const auto count = static_cast<int>(circle.size());
        const Eigen::Vector3d normal = samples_.normals[sample].cast<double>();
        const double turn = phase(sample, circle.size());
        // The circle turned by the sample's own phase.
        const double turnAngle = 6.283185307179586 * turn;
        const Eigen::Vector3d u0 = normal.unitOrthogonal();
        const Eigen::Vector3d v0 = normal.cross(u0);
        const Eigen::Vector3d u = std::cos(turnAngle) * u0 + std::sin(turnAngle) * v0;
        const Eigen::Vector3d v = normal.cross(u);
        for (const int side : {1, -1}) {
            for (int k = 0; k < count; ++k) {
                const double cosine = 1 - (k + turn) / static_cast<double>(count) * (1 - cosLimit_);
                const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
                const Eigen::Vector2d& at = circle[static_cast<std::size_t>(k)];
                const Eigen::Vector3d direction =
                    side * cosine * normal + sine * (at.x() * u + at.y() * v);
                if (const auto eye = lookAlong(sample, side, direction)) {
                    return {eye->cast<float>(), static_cast<std::int8_t>(side)};
                }
            }
        }
        return {};
    }

    /// Whether this reachable position sees the sample.
    Sight lookFrom(std::size_t sample, const Eigen::Vector3f& eye) const {
        const Eigen::Vector3d point = samples_.points[sample].cast<double>();
        const Eigen::Vector3d normal = samples_.normals[sample].cast<double>();
        Eigen::Vector3d direction = eye.cast<double>() - point;
        const double range = direction.norm();
        if (range < space_.nearLimit || range > space_.farLimit || range <= 0) {
            return {};
        }
        direction /= range;
        const double cosine = direction.dot(normal);
        if (std::abs(cosine) < cosLimit_ || !elevationAllowed(direction)) {
            return {};
        }
        const int side = cosine > 0 ? 1 : -1;
        if (freeLength(point + side * offset_ * normal, direction, range) < range - offset_) {
            return {};
        }
        return {eye, static_cast<std::int8_t>(side)};
    }

 private:
    static double sineOf(double elevation) {
        return std::sin(std::clamp(elevation, -1.5707963267948966, 1.5707963267948966));
    }

    bool elevationAllowed(const Eigen::Vector3d& fromSample) const {
        constexpr double kRounding = 1e-12;
        return -fromSample.z() >= lowest_ - kRounding && -fromSample.z() <= highest_ + kRounding;
    }

    double freeLength(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                      double limit) const {
        const auto hit = caster_.cast(origin, direction, limit);
        return hit ? hit->t : limit;
    }

    /// The part of the ray from `near` to `far` inside the box.
    std::optional<std::pair<double, double>> clip(const Eigen::Vector3d& origin,
                                                  const Eigen::Vector3d& direction, double near,
                                                  double far) const {
        for (int a = 0; a < 3; ++a) {
            if (std::abs(direction[a]) < 1e-12) {
                if (origin[a] < space_.boxMin[a] || origin[a] > space_.boxMax[a]) {
                    return std::nullopt;
                }
                continue;
            }
            double t0 = (space_.boxMin[a] - origin[a]) / direction[a];
            double t1 = (space_.boxMax[a] - origin[a]) / direction[a];
            if (t0 > t1) {
                std::swap(t0, t1);
            }
            near = std::max(near, t0);
            far = std::min(far, t1);
        }
        if (near > far) {
            return std::nullopt;
        }
        return std::make_pair(near, far);
    }

    std::optional<Eigen::Vector3d> lookAlong(std::size_t sample, int side,
                                             const Eigen::Vector3d& direction) const {
        if (!elevationAllowed(direction)) {
            return std::nullopt;
        }
        const Eigen::Vector3d point = samples_.points[sample].cast<double>();
        const auto inBox = clip(point, direction, space_.nearLimit, space_.farLimit);
        if (!inBox) {
            return std::nullopt;
        }
        const Eigen::Vector3d origin =
            point + side * offset_ * samples_.normals[sample].cast<double>();
        const double end = std::min(inBox->second, freeLength(origin, direction, inBox->second));
        // Where the grid alone does not say yes, the roomiest place is looked at exactly.
        double doubtful = 0;
        float roomiest = 0;
        for (double t = inBox->first; t <= end; t += 0.5 * reachable_.grid()) {
            const ReachableSpace::Room room = reachable_.room(point + t * direction);
            if (room.certain) {
                return point + t * direction;
            }
            if (room.estimate > roomiest) {
                roomiest = room.estimate;
                doubtful = t;
            }
        }
        if (roomiest > 0 && reachable_.contains(point + doubtful * direction)) {
            return point + doubtful * direction;
        }
        return std::nullopt;
    }

    const RayCaster& caster_;
    const ViewSpace& space_;
    const ReachableSpace& reachable_;
    const SurfaceSamples& samples_;
    double cosLimit_;
    double lowest_, highest_;  ///< sine of the elevations that the camera looks up and down at most
    double offset_;
};

/// Samples not seen yet look from where their neighbours were seen, until nothing changes.
class Spreading {
 public:
    Spreading(const SightFinder& finder, const SurfaceSamples& samples)
        : finder_(finder),
          samples_(samples),
          radius_(static_cast<float>(3 * spacingOf(samples))),
          index_(samples.points, radius_) {}

    /// True if a sample nearby was seen.
    bool besideSeen(std::size_t sample, const std::vector<Sight>& sights) const {
        return index_.anyWithin(samples_.points[sample], radius_, [&](std::uint32_t other, float) {
            return sights[other].side != 0;
        });
    }

    void run(std::vector<Sight>& sights) const {
        std::vector<std::uint8_t> fresh(sights.size());
        for (std::size_t i = 0; i < sights.size(); ++i) {
            fresh[i] = sights[i].side != 0;
        }
        for (bool changed = true; changed;) {
            std::vector<Sight> next = sights;
            parallelForEach(sights.size(), 64, [&](std::size_t i) {
                if (sights[i].side == 0) {
                    next[i] = fromNeighbours(i, sights, fresh);
                }
            });
            changed = false;
            for (std::size_t i = 0; i < sights.size(); ++i) {
                fresh[i] = next[i].side != sights[i].side;
                changed = changed || fresh[i] != 0;
            }
            sights.swap(next);
        }
    }

 private:
    Sight fromNeighbours(std::size_t sample, const std::vector<Sight>& sights,
                         const std::vector<std::uint8_t>& fresh) const {
        Sight found;
        std::size_t tried = 0;
        index_.anyWithin(samples_.points[sample], radius_, [&](std::uint32_t other, float) {
            if (fresh[other] == 0 || sights[other].side == 0) {
                return false;
            }
            found = finder_.lookFrom(sample, sights[other].eye);
            return found.side != 0 || ++tried >= kMostNeighbours;
        });
        return found;
    }

    const SightFinder& finder_;
    const SurfaceSamples& samples_;
    float radius_;
    PointIndex index_;
};

/// Without the start: all starts in one connected space have the same set.
std::uint64_t keyOf(const SurfaceSamples& samples, const ViewSpace& space,
                    const ReachableSpace& reachable, const EvalOptions& options) {
    Fnv hash;
    hash.add(kMethodVersion);
    hash.add(samples.meshHash);
    hash.add(samples.seed);
    hash.add(static_cast<std::uint64_t>(samples.points.size()));
    for (int k = 0; k < 3; ++k) {
        hash.add(space.boxMin[k]);
        hash.add(space.boxMax[k]);
    }
    for (const double x : {space.clearance, space.nearLimit, space.farLimit, space.minElevation,
                           space.maxElevation, options.maxIncidence, options.grid}) {
        hash.add(x);
    }
    hash.add(options.directions);
    reachable.forEach([&](const Eigen::Vector3d& p) {
        hash.add(p.x());
        hash.add(p.y());
        hash.add(p.z());
    });
    return hash.value();
}

}  // namespace

ViewSpace viewSpaceOf(const PlatformLimits& limits, const StereoCamera& camera,
                      const Eigen::Vector3d& start) {
    ViewSpace space;
    space.boxMin = limits.boxMin;
    space.boxMax = limits.boxMax;
    space.start = start;
    space.clearance = limits.clearance;
    space.nearLimit = limits.nearLimit;
    space.farLimit = limits.farLimit;
    if (limits.kind == PlatformLimits::Kind::kGroundPanTilt) {
        space.boxMin.z() = std::max(space.boxMin.z(), limits.minHeight);
        space.boxMax.z() = std::min(space.boxMax.z(), limits.maxHeight);
        space.minElevation = limits.minTilt - std::atan((camera.height - camera.cy) / camera.fy);
        space.maxElevation = limits.maxTilt + std::atan(camera.cy / camera.fy);
    }
    return space;
}

ObservableSet observableSet(const RayCaster& caster, const ViewSpace& space,
                            const SurfaceSamples& samples, const EvalOptions& options,
                            const OnProgress& progress) {
    ObservableSet out;
    const ReachableSpace reachable(caster, space, options.grid);
    out.key = keyOf(samples, space, reachable, options);
    out.grid = reachable.grid();
    const std::size_t count = samples.points.size();
    std::vector<std::int8_t> sides;
    if (!options.cache.empty() && readObservable(options.cache, out.key, count, sides)) {
        out.fromCache = true;
    } else {
        const SightFinder finder(caster, space, reachable, samples, options.maxIncidence);
        std::vector<Sight> sights(count);
        const Spreading spreading(finder, samples);
        const auto rounds = roundsOf(options.directions, spacingOf(samples));
        // Large pieces, for the threads wait for each other after each.
        const std::size_t atOnce = std::max<std::size_t>(4096, count / 50);
        std::size_t done = 0;
        for (const Round& round : rounds) {
            const std::vector<Sight> before = sights;
            const std::vector<Eigen::Vector2d> circle = SightFinder::goldenCircle(round.directions);
            for (std::size_t begin = 0; begin < count; begin += atOnce) {
                const std::size_t some = std::min(atOnce, count - begin);
                parallelForEach(some, 64, [&](std::size_t k) {
                    const std::size_t i = begin + k;
                    if (before[i].side == 0 &&
                        (!round.onlyBesideSeen || spreading.besideSeen(i, before))) {
                        sights[i] = finder.lookOut(i, circle);
                    }
                });
                done += some;
                if (progress) {
                    progress(done, rounds.size() * count);
                }
            }
            spreading.run(sights);
        }
        sides.resize(count);
        std::transform(sights.begin(), sights.end(), sides.begin(),
                       [](const Sight& s) { return s.side; });
        if (!options.cache.empty()) {
            writeObservable(options.cache, out.key, sides);
        }
    }
    out.observable.resize(count);
    out.normals = samples.normals;
    for (std::size_t i = 0; i < count; ++i) {
        out.observable[i] = sides[i] != 0;
        out.count += out.observable[i];
        if (sides[i] < 0) {
            out.normals[i] = -out.normals[i];
        }
    }
    return out;
}

}  // namespace riftmap
