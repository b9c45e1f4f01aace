// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <queue>
#include <random>

#include "baseline_tools.h"
#include "riftmap/core/parallel.h"
#include "riftmap/eval/coverage.h"

namespace riftmap {

namespace {

constexpr std::size_t kMostPlaces = 20000;  ///< of the surface, that views are picked by

/// Greedy maximum coverage: of many poses always the one that shows most that no view has shown.
/// No choice of as many views covers more than 1 / (1 - 1/e) times as much (Nemhauser, Wolsey &
/// Fisher 1978), as far as these poses go.
class Foresight : public ViewSource {
 public:
    Foresight(const CoverageJudge& judge, const RayCaster& caster, const BaselineOptions& options,
              std::uint64_t seed)
        : caster_(&caster),
          count_(static_cast<std::size_t>(options.poses)),
          farthestApart_(2 * judge.headline()),
          random_(seed) {
        const SurfaceSamples& samples = judge.samples();
        const ObservableSet& observable = judge.observable();
        const std::size_t stride = (observable.count + kMostPlaces - 1) / kMostPlaces;
        for (std::size_t i = 0, k = 0; i < samples.points.size(); ++i) {
            if (observable.observable[i] != 0 && k++ % stride == 0) {
                places_.push_back(samples.points[i].cast<double>());
                normals_.push_back(observable.normals[i].cast<double>());
            }
        }
        shown_.resize(places_.size(), 0);
    }

    std::optional<std::vector<Pose>> next(const BaselineState& state) override {
        if (poses_.empty()) {
            prepare(state);
        }
        for (const std::uint32_t place : seenFrom(state, state.pose)) {
            shown_[place] = 1;
        }
        std::vector<Entry> noWay;  // from here
        std::optional<std::vector<Pose>> path;
        while (!path) {
            const std::optional<Entry> best = popBest();
            if (!best) {
                break;
            }
            path = pathTo(state, poses_[best->second], 20000);
            if (!path) {
                noWay.push_back(*best);
            }
        }
        for (const Entry& entry : noWay) {
            queue_.push(entry);
        }
        return path;
    }

 private:
    /// Places not shown yet that a pose shows (or more, as long as it is not counted again), pose.
    using Entry = std::pair<std::size_t, std::size_t>;

    void prepare(const BaselineState& state) {
        const ReachableSpace space(
            *caster_, viewSpaceOf(state.limits, state.camera, state.pose.translation), 0);
        std::vector<Eigen::Vector3d> eyes;
        space.forEach([&](const Eigen::Vector3d& eye) { eyes.push_back(eye); });
        for (std::size_t i = 0; i < count_ && !eyes.empty(); ++i) {
            const Eigen::Vector3d& eye = eyes[random_() % eyes.size()];
            poses_.push_back(viewOf(state.limits, eye, randomDirection(random_)));
        }
        seen_.resize(poses_.size());
        parallelForEach(poses_.size(), 16,
                        [&](std::size_t i) { seen_[i] = seenFrom(state, poses_[i]); });
        for (std::size_t i = 0; i < poses_.size(); ++i) {
            queue_.emplace(seen_[i].size(), i);
        }
    }

    /// Of the surface, what a view shows so that it is covered: in view, not hidden, not too flat,
    /// and so near that neighbouring pixels lie close enough.
    std::vector<std::uint32_t> seenFrom(const BaselineState& state, const Pose& view) const {
        constexpr double kFlattest = 0.259;  // cosine of the 75 degrees of "observable"
        std::vector<std::uint32_t> seen;
        for (std::uint32_t i = 0; i < places_.size(); ++i) {
            const Eigen::Vector3d& p = places_[i];
            if (!inView(state, view, p)) {
                continue;
            }
            const Eigen::Vector3d ray = view.translation - p;
            const double facing = normals_[i].dot(ray.normalized());
            const double depth = -view.rotation.col(2).dot(ray);
            if (facing > kFlattest && depth < facing * farthestApart_ * state.camera.fx &&
                !caster_->occluded(view.translation, p)) {
                seen.push_back(i);
            }
        }
        return seen;
    }

    /// What a pose adds only shrinks, so that the greatest of the old values that still holds is
    /// the greatest of all.
    std::optional<Entry> popBest() {
        while (!queue_.empty()) {
            Entry entry = queue_.top();
            queue_.pop();
            const std::vector<std::uint32_t>& seen = seen_[entry.second];
            const auto now = static_cast<std::size_t>(std::count_if(
                seen.begin(), seen.end(), [&](std::uint32_t place) { return shown_[place] == 0; }));
            if (now == entry.first && now > 0) {
                return entry;
            }
            if (now > 0) {
                queue_.emplace(now, entry.second);
            }
        }
        return std::nullopt;
    }

    const RayCaster* caster_;
    std::size_t count_;
    double farthestApart_;  ///< pixels on a place that is covered [m]
    std::mt19937_64 random_;
    std::vector<Eigen::Vector3d> places_, normals_;
    std::vector<std::uint8_t> shown_;  ///< by any view so far
    std::vector<Pose> poses_;
    std::vector<std::vector<std::uint32_t>> seen_;  ///< of each pose, indices of places
    std::priority_queue<Entry> queue_;
};

}  // namespace

std::unique_ptr<ViewSource> makeForesight(const CoverageJudge& judge, const RayCaster& caster,
                                          const BaselineOptions& options, std::uint64_t seed) {
    return std::make_unique<Foresight>(judge, caster, options, seed);
}

}  // namespace riftmap
