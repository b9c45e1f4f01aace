// SPDX-License-Identifier: BSD-3-Clause
// The choice of views around an object that stands alone: a tour over views that complement each
// other.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "lazy_greatest.h"
#include "riftmap/core/parallel.h"
#include "riftmap/planner/thin_shells.h"
#include "view_choice.h"

namespace riftmap {

namespace {

constexpr double kPi = 3.14159265358979323846;

/// Length of the shortest way from a to b around a ball.
double wayAround(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& centre,
                 double radius) {
    const double ra = (a - centre).norm();
    const double rb = (b - centre).norm();
    if (ra <= radius || rb <= radius) {
        return (a - b).norm();
    }
    const double angle = std::acos(std::clamp((a - centre).dot(b - centre) / (ra * rb), -1.0, 1.0));
    const double onBall = angle - std::acos(radius / ra) - std::acos(radius / rb);
    if (onBall <= 0) {
        return (a - b).norm();
    }
    return std::sqrt(ra * ra - radius * radius) + std::sqrt(rb * rb - radius * radius) +
           radius * onBall;
}

}  // namespace

/// Views of a tear from where nothing known hides it: looks out from the tear itself.
void Choice::addInSight(const RiftRecord& record, int directions, std::size_t most) {
    const Eigen::Vector3d p = record.cell.openPosition.cast<double>();
    const Eigen::Vector3d n = record.cell.normal.cast<double>();
    Eigen::Vector3d facing = n + 0.7 * record.cell.outward.cast<double>();
    facing = facing.norm() > 1e-3 ? facing.normalized()
                                  : Eigen::Vector3d((k_.camera().translation - p).normalized());
    const Eigen::Vector3d t = anyPerpendicular(facing);
    const Eigen::Vector3d side = facing.cross(t);
    const double step = k_.unseen().voxelSize();
    const double turn = uniform(0, 2 * kPi);
    std::size_t added = 0;
    // From straight on to far aslant, evenly over the sphere.
    for (int i = 0; i < directions && added < most; ++i) {
        const double z = 1.0 - 0.9 * (i + 0.5) / directions;
        const double r = std::sqrt(1 - z * z);
        const double a = turn + 2.399963 * i;
        const Eigen::Vector3d out = z * facing + r * (std::cos(a) * t + std::sin(a) * side);
        bool hidden = false;
        for (double s = 2.5 * step; s < 1.5 && !hidden; s += 0.7 * step) {
            hidden = k_.unseen().at(p + s * out) == FreeSpace::State::kSurface;
        }
        if (!hidden) {
            const double least = 1.15 * k_.sensor().nearLimit;
            const double distance = uniform(least, std::max(least + 0.1, good_));
            added += add(p + distance * out, p) ? 1U : 0U;
        }
    }
}

/// Around an object: from all sides, as near as the range allows to as far as the good depth.
void Choice::addPlacesAround(const Eigen::AlignedBox3d& box) {
    const double least = std::max(0.5 * k_.sensor().nearLimit, 0.1);
    const double most = std::max(least + 0.1, 0.8 * good_);
    for (int i = 0; i < 4 * k_.options().places; ++i) {
        const double z = uniform(-1, 1);
        const double a = uniform(0, 2 * kPi);
        const double r = std::sqrt(1 - z * z);
        const Eigen::Vector3d out(r * std::cos(a), r * std::sin(a), z);
        const double away = uniform(least, most);
        // What is seen at once from there: the rest of the box is for other views.
        const Eigen::Vector3d spare =
            (0.5 * box.sizes().array() - 0.35 * (away + 0.3)).max(0.1 * box.sizes().array());
        const Eigen::Vector3d target =
            box.center() +
            spare.cwiseProduct(Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)));
        double exit = std::numeric_limits<double>::infinity();
        for (int axis = 0; axis < 3; ++axis) {
            const double side = out[axis] > 0 ? box.max()[axis] : box.min()[axis];
            if (std::abs(out[axis]) > 1e-6) {
                exit = std::min(exit, (side - target[axis]) / out[axis]);
            }
        }
        add(target + (exit + away) * out, target);
    }
}

/// Gain of views of an object as its tour has it.
ViewScore Choice::scoreAround(const Pose& pose) const {
    return scoreOf(scorer_.sights(pose));
}

ViewScore Choice::scoreOf(const ViewScorer::Seen& seen) const {
    ViewScore score;
    score.nearShare = seen.nearShare;
    score.gain = SeenItems(worth_).gain(TourView{seen.sights, 0});
    for (const Sight& s : seen.sights) {
        const auto cell = scorer_.cellOf(s.item);
        const auto gain = static_cast<double>(worth_[s.item] * s.share);
        if (!cell) {
            score.unknownGain += gain;
            continue;
        }
        score.openGain += gain;
        score.coarseGain += ViewScorer::isTear(s.item) ? 0.0 : gain;
        // Well enough to count as a try, however little is left of its worth.
        const RiftRecord& record = *scorer_.open()[*cell];
        if (static_cast<double>(s.share) > 0.25 * scorer_.leftAfterTries(record)) {
            score.cells.push_back(record.cell.key);
        }
    }
    std::sort(score.cells.begin(), score.cells.end());
    score.cells.erase(std::unique(score.cells.begin(), score.cells.end()), score.cells.end());
    return score;
}

/// The best of the candidates alone is left.
void Choice::keepBestAround() {
    std::vector<ViewScorer::Seen> seen(candidates_.size());
    std::vector<double> utilities(candidates_.size());
    parallelForEach(seen.size(), 4, [&](std::size_t i) {
        Candidate& c = candidates_[i];
        seen[i] = scorer_.sightsAtMost(c.pose);
        rate(c, scoreOf(seen[i]));
        utilities[i] = c.utility;
    });
    const std::size_t best = greatestOf(utilities, [&](std::span<const std::size_t> some) {
        parallelForEach(some.size(), 1, [&](std::size_t k) {
            const std::size_t i = some[k];
            Candidate& c = candidates_[i];
            scorer_.dropHidden(seen[i].sights, seen[i].gaps, c.pose);
            rate(c, scoreOf(seen[i]));
            utilities[i] = c.utility;
        });
    });
    if (best < seen.size()) {  // as a rule: the first was picked for its gain
        candidates_ = {Candidate(candidates_[best])};
    } else {
        candidates_.resize(1);
    }
}

/// The one candidate that is left becomes a better one, by changes that get smaller.
void Choice::climbAround() {
    constexpr int kChanges = 12;
    for (const double scale : {2.0, 1.26, 0.79, 0.5}) {
        vary(Candidate(candidates_.front()), kChanges, scale);
        keepBestAround();
    }
}

/// Places of the frontier that a view looks at.
std::vector<Eigen::Vector3d> Choice::frontierSeen(const Pose& pose) const {
    std::vector<Eigen::Vector3d> places;
    for (const Sight& s : scorer_.sightsAtMost(pose).sights) {  // lines are for gaps
        const auto place = scorer_.frontierOf(s.item);
        if (place && s.item % 2 == 0 && s.share > 0.25F) {
            places.push_back(scorer_.frontier()[*place].centre.cast<double>());
        }
    }
    return places;
}

/// Around an object that stands alone: a tour over views that complement each other, of which the
/// first is taken.
std::optional<ViewPlan> Choice::makeAround(const Eigen::AlignedBox3d& box) {
    addPlacesAround(box);
    addPool();
    std::vector<FreeSpace::Frontier> frontier = k_.unseen().frontier(box);
    const ThinShells shells(k_.unseen(), k_.summary(), frontier);
    std::erase_if(frontier, [&](const auto& place) { return shells.hold(place); });
    scorer_.setFrontier(std::move(frontier), k_.unseen().voxelSize());
    worth_ = scorer_.worth();
    for (std::size_t i = 0; i < scorer_.open().size(); ++i) {
        const SurfaceCell& cell = scorer_.open()[i]->cell;
        if (cell.hidden > 0 && shells.touch(cell.hiddenPosition.cast<double>())) {
            worth_[2 * i] = 0;  // hides the inside only
        }
    }
    std::vector<TourView> views(candidates_.size());
    parallelForEach(candidates_.size(), 4, [&](std::size_t i) {
        ViewScorer::Seen seen = scorer_.sightsAtMost(candidates_[i].pose);
        candidates_[i].score.nearShare = seen.nearShare;
        views[i].fromStart = candidates_[i].path;
        if (seen.nearShare <= 0.3) {
            views[i].sights = std::move(seen.sights);
            views[i].uncertain = std::move(seen.gaps);
        }
    });
    const double ball = box.sizes().mean() / 2 + k_.limits().clearance;
    TourOptions options;
    options.viewCost = k_.options().viewCost;
    options.minGain = k_.minGain();
    options.settled = 0.3 * k_.summary().area();
    const ViewTour tour = planTour(
        std::move(views), worth_,
        [&](std::size_t a, std::size_t b) {
            return wayAround(candidates_[a].pose.translation, candidates_[b].pose.translation,
                             box.center(), ball);
        },
        options,
        [&](std::size_t i, TourView& view) {
            scorer_.dropHidden(view.sights, view.uncertain, candidates_[i].pose);
        });
    pool_.clear();
    for (std::size_t i = 1; i < tour.views.size(); ++i) {
        pool_.push_back(candidates_[tour.views[i]].pose);
    }
    if (tour.views.empty()) {
        return lastResorts();
    }
    candidates_ = {Candidate(candidates_[tour.views.front()])};
    climbAround();
    return planFor(candidates_.front());
}

}  // namespace riftmap
