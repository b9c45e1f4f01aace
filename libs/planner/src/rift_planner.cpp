// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "riftmap/core/parallel.h"
#include "view_choice.h"

namespace riftmap {

namespace {

constexpr double kPi = 3.14159265358979323846;

ViewScorer::Weights weightsFor(const Knowledge& k, const ObjectMemory& memory) {
    ViewScorer::Weights weights;
    weights.unknown = k.options().unknownWeight;
    weights.newSurfaceDepth = k.options().newSurfaceDepth;
    if (k.surfaceBox()) {
        // Unseen surface counts where it may be (the frontier), so the rims of the surface seen
        // stand for holes that are smaller than that, and coarse surface is mostly covered. All so
        // that gains come true: predicted against measured on five objects.
        weights.coarse = 0.15;
        weights.unknown *= memory.frontier.share();
        weights.hidden = 0.65 * memory.tears.share();
        weights.doubt = memory.doubt.share();
        weights.vain = weights.vainUnmatched = 0.4;
        weights.gapsByLine = true;
    } else {
        weights.byExperience = k.sensor().matched();
    }
    return weights;
}

/// From one place in the box towards another as far as it lies in there, axis by axis.
Eigen::Vector3d movedWithin(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from,
                            const Eigen::Vector3d& to) {
    return (to.array() >= box.min().array() && to.array() <= box.max().array()).select(to, from);
}

}  // namespace

Eigen::Vector3d anyPerpendicular(const Eigen::Vector3d& n) {
    const Eigen::Vector3d axis =
        std::abs(n.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
    return n.cross(axis).normalized();
}

Eigen::Vector3d evenDirection(int i, int n) {
    const double z = 1 - (2 * i + 1.0) / n;
    const double r = std::sqrt(1 - z * z);
    return {r * std::cos(2.399963 * i), r * std::sin(2.399963 * i), z};
}

Choice::Choice(Knowledge& knowledge, std::vector<Pose>& pool, ObjectMemory& memory)
    : k_(knowledge),
      pool_(pool),
      memory_(memory),
      scorer_(k_.sensor(), k_.summary(), k_.ledger(), k_.space(), k_.resolution(),
              weightsFor(k_, memory)),
      random_(k_.options().seed * 1000003U + k_.views()),
      good_(k_.sensor().goodDepth(k_.resolution())) {}

/// Adds the view if the camera can get there, from Knowledge::placeAt().
bool Choice::add(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
    const auto place = k_.placeAt(eye);
    if (!place || (target - place->eye).norm() < 1e-6) {
        return false;
    }
    Candidate c;
    c.pose = k_.sensor().lookingAt(place->eye, target);
    c.path = place->path;
    if (!k_.tiltAllowed(c.pose)) {
        return false;
    }
    candidates_.push_back(std::move(c));
    return true;
}

/// Views of a tear: along the normal, over the rim, back across it, and from both sides; near and
/// from where one view still measures well.
void Choice::addAround(const RiftRecord& record, int directions) {
    const Eigen::Vector3d p = record.cell.openPosition.cast<double>();
    Eigen::Vector3d n = record.cell.openNormal.cast<double>();
    if (n.norm() < 0.5) {
        n = (k_.camera().translation - p).normalized();
    }
    Eigen::Vector3d t = record.cell.outward.cast<double>();
    const bool rim = t.norm() > 0.25;
    t = rim ? t.normalized() : anyPerpendicular(n);
    const Eigen::Vector3d side = n.cross(t).normalized();
    const double turn = uniform(0, 2 * kPi);
    std::vector<Eigen::Vector3d> ways = {n, n + 0.7 * t, 0.35 * n + t, n + 1.4 * t};
    if (!rim) {
        ways.back() = n - 0.7 * t;
    }
    ways.push_back(n + 0.8 * (std::cos(turn) * t + std::sin(turn) * side));
    for (int i = 5; i < directions; ++i) {
        const double angle = turn + 2.4 * i;
        const double tilt = std::sqrt((i - 4.0) / (directions - 4.0)) * 1.3;
        ways.push_back(std::cos(tilt) * n +
                       std::sin(tilt) * (std::cos(angle) * t + std::sin(angle) * side));
    }
    const double least = 1.2 * k_.sensor().nearLimit + 0.02;
    const double most = std::max(least, (rim ? 1.4 : 1.0) * good_);
    for (const Eigen::Vector3d& way : ways) {
        const Eigen::Vector3d d = way.normalized();
        for (const double s : {0.12, 0.5, 0.95}) {
            const double distance =
                least + (most - least) * std::clamp(s + uniform(-0.1, 0.1), 0.0, 1.0);
            // The rim need not be in the middle: what is to be found lies beyond it.
            const Eigen::Vector3d target = p + (rim ? 0.2 : 0.0) * distance * t;
            add(p + distance * d, target);
        }
    }
}

/// As many candidates at tears as one plan has time for, by lot.
void Choice::thinOut() {
    const auto most = static_cast<std::size_t>(k_.options().candidates);
    for (std::size_t i = 0; i < most && i < candidates_.size(); ++i) {
        std::swap(candidates_[i], candidates_[i + random_() % (candidates_.size() - i)]);
    }
    if (candidates_.size() > most) {
        candidates_.resize(most);
    }
}

/// Turning where the camera is costs no way.
void Choice::addTurns() {
    const Eigen::Vector3d eye = k_.camera().translation;
    const double start = uniform(0, kPi / 4);
    for (int i = 0; i < 8; ++i) {
        for (const double tilt : {-1.0, -0.35, 0.35, 1.0}) {
            const double a = start + i * kPi / 4;
            add(eye, eye + Eigen::Vector3d(std::cos(tilt) * std::cos(a),
                                           std::cos(tilt) * std::sin(a), std::sin(tilt)));
        }
    }
}

void Choice::addPlaces() {
    const std::vector<Eigen::Vector3d> all = k_.space().reachable(2);
    if (all.empty()) {
        return;
    }
    for (int i = 0; i < k_.options().places; ++i) {
        const Eigen::Vector3d& eye = all[random_() % all.size()];
        const double start = uniform(0, 2 * kPi);
        for (int j = 0; j < 4; ++j) {
            const double a = start + j * kPi / 2;
            const double tilt = uniform(-0.9, 0.9);
            add(eye, eye + Eigen::Vector3d(std::cos(tilt) * std::cos(a),
                                           std::cos(tilt) * std::sin(a), std::sin(tilt)));
        }
    }
}

/// Good views of the plans before, that were not taken.
void Choice::addPool() {
    for (const Pose& pose : pool_) {
        const auto place = k_.placeAt(pose.translation);
        if (place && place->path > 0) {
            Candidate c;
            c.pose = pose;
            c.pose.translation = place->eye;
            c.path = place->path;
            candidates_.push_back(std::move(c));
        }
    }
}

/// Whether two views are from about the same place in about the same direction.
bool Choice::alike(const Pose& a, const Pose& b) const {
    constexpr double kVoxels = 6;
    constexpr double kTurned = 0.8;  // cosine between their axes
    return (a.translation - b.translation).norm() < kVoxels * k_.space().voxelSize() &&
           a.rotation.col(2).dot(b.rotation.col(2)) > kTurned;
}

/// Indices of the candidates of greatest value above 0, best first; of those that are alike the
/// first.
std::vector<std::size_t> Choice::bestApart(std::size_t most, Value valueOf) const {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
        if (valueOf(candidates_[i]) > 0) {
            order.push_back(i);
        }
    }
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return valueOf(candidates_[a]) > valueOf(candidates_[b]);
    });
    std::vector<std::size_t> apart;
    for (std::size_t i = 0; i < order.size() && apart.size() < most; ++i) {
        const Pose& pose = candidates_[order[i]].pose;
        if (std::none_of(apart.begin(), apart.end(),
                         [&](std::size_t other) { return alike(pose, candidates_[other].pose); })) {
            apart.push_back(order[i]);
        }
    }
    return apart;
}

void Choice::keepPool() {
    constexpr std::size_t kPool = 64;
    pool_.clear();
    for (const std::size_t i :
         bestApart(kPool, [](const Candidate& c) { return c.path > 0 ? c.score.gain : 0.0; })) {
        pool_.push_back(candidates_[i].pose);
    }
}

/// So many changes of a view. At a scale of 1 it is moved by up to two voxels an axis (four in ten
/// are not, nor is a view from where the camera is), but along no axis out of its box (on wheels it
/// is a few voxels high), and turned by some 10 degrees.
void Choice::vary(const Candidate& view, int count, double scale) {
    const Pose pose = view.pose;
    const double reach = scale * 2.0 * k_.space().voxelSize();
    const Eigen::Vector3d axis = pose.rotation.col(2);
    for (int i = 0; i < count; ++i) {
        const Eigen::Vector3d shift(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
        const Eigen::Vector3d turn =
            scale * 0.25 * Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
        const bool stay = view.path == 0.0 || i % 3 == 0;
        const Eigen::Vector3d moved = pose.translation + reach * shift;
        const auto place = k_.placeAt(stay ? pose.translation
                                           : movedWithin(k_.cameraBox(), pose.translation, moved));
        if (!place) {
            continue;
        }
        Candidate c;
        c.path = place->path;
        c.pose = lookAt(place->eye, place->eye + axis + turn);
        if (k_.tiltAllowed(c.pose)) {
            candidates_.push_back(std::move(c));
        }
    }
}

void Choice::rate(Candidate& c, const ViewScore& score) const {
    c.score = score;
    // Matching makes up surface where all is too near.
    const double gain = score.gain * std::max(0.0, 1.0 - 2.5 * score.nearShare);
    c.utility = gain / (k_.options().viewCost + c.path);
}

void Choice::scoreFrom(std::size_t first) {
    parallelForEach(candidates_.size() - first, 1, [&](std::size_t i) {
        Candidate& c = candidates_[first + i];
        rate(c, k_.surfaceBox() ? scoreAround(c.pose)
                : c.drawing     ? scorer_.score(*c.drawing)
                                : scorer_.score(c.pose));
        c.drawing.reset();
    });
}

/// Where there are more open cells than can be weighed for every candidate, those that an estimate
/// likes best are left.
void Choice::preselect() {
    constexpr std::size_t kLeft = 48;
    if (!scorer_.samples() || candidates_.size() <= kLeft) {
        return;
    }
    parallelForEach(candidates_.size(), 1, [&](std::size_t i) {
        Candidate& c = candidates_[i];
        c.drawing = scorer_.draw(c.pose);
        rate(c, scorer_.estimate(*c.drawing));
    });
    std::stable_sort(candidates_.begin(), candidates_.end(),
                     [](const Candidate& a, const Candidate& b) { return a.utility > b.utility; });
    candidates_.resize(kLeft);
}

/// From the best views that differ on to better ones: wide changes first, then ever smaller ones.
/// The candidates are few for all the poses that there are (tests: Climb).
void Choice::climb() {
    constexpr int kRounds = 8;
    constexpr double kWidest = 4;  // scale of the changes
    constexpr double kFinest = 0.5;
    constexpr std::size_t kViews = 2;
    constexpr int kChanges = 10;
    for (int round = 0; round < kRounds; ++round) {
        const double scale = kWidest * std::pow(kFinest / kWidest, round / (kRounds - 1.0));
        const std::size_t first = candidates_.size();
        for (const std::size_t i :
             bestApart(kViews, [](const Candidate& c) { return c.utility; })) {
            vary(Candidate(candidates_[i]), kChanges, scale);
        }
        scoreFrom(first);
    }
}

const Candidate* Choice::best() const {
    const Candidate* best = nullptr;
    for (const Candidate& c : candidates_) {
        if (best == nullptr || c.utility > best->utility) {
            best = &c;
        }
    }
    return best;
}

std::optional<ViewPlan> Choice::planFor(const Candidate& c) const {
    ViewPlan plan;
    plan.path = c.path == 0.0 ? std::vector<Pose>{c.pose} : k_.pathTo(c.pose);
    plan.gain = c.score.gain;
    plan.tearGain = std::max(0.0, c.score.openGain - c.score.coarseGain);
    plan.coarseGain = c.score.coarseGain;
    plan.unknownGain = c.score.unknownGain;
    plan.cells = c.score.cells;
    // Or a view that was in vain would leave no trace, and might be taken for ever.
    plan.cells.insert(plan.cells.end(), c.score.badlySeen.begin(), c.score.badlySeen.end());
    std::sort(plan.cells.begin(), plan.cells.end());
    plan.unknown = k_.surfaceBox() ? frontierSeen(c.pose) : scorer_.unknownSeen(c.pose);
    if (plan.path.empty()) {
        return std::nullopt;
    }
    return plan;
}

std::optional<ViewPlan> Choice::make() {
    if (auto plan = wayOut()) {
        return plan;
    }
    const auto& open = scorer_.open();
    const auto targets = static_cast<std::size_t>(k_.options().targets);
    const std::size_t stride = std::max<std::size_t>(1, open.size() / targets);
    for (std::size_t i = random_() % stride; i < open.size(); i += stride) {
        if (k_.surfaceBox()) {
            addInSight(*open[i], 24, 5);
        } else {
            addAround(*open[i], 5);
        }
    }
    thinOut();
    if (k_.surfaceBox()) {
        return makeAround(*k_.surfaceBox());
    }
    addTurns();
    addPlaces();
    addPool();
    preselect();
    scoreFrom(0);
    climb();
    keepPool();
    std::erase_if(candidates_, [&](const Candidate& c) {
        return c.score.gain < k_.minGain() || c.score.nearShare > 0.3;
    });
    const Candidate* b = best();
    constexpr double kLittle = 0.002;  // of the surface: worth a look for passages
    if ((b == nullptr || b->score.gain < kLittle * k_.summary().area()) && k_.openPassages(false)) {
        return Choice(k_, pool_, memory_).make();
    }
    if (b != nullptr) {
        if (auto plan = planFor(*b)) {
            return plan;
        }
    }
    return lastResorts();
}

std::optional<ViewPlan> RiftPlanner::next(Knowledge& knowledge) {
    if (!knowledge.surfaceBox()) {
        auto plan = Choice(knowledge, pool_, memory_).make();
        if (!plan && knowledge.openPassages(true)) {
            plan = Choice(knowledge, pool_, memory_).make();
        }
        return plan;
    }
    // A way that was too long for one step ended at another view than the one that promised.
    const double off = (knowledge.camera().translation - memory_.target).norm();
    if (off < knowledge.space().voxelSize()) {
        memory_.update(knowledge.summary(), knowledge.minGain());
    }
    auto plan = Choice(knowledge, pool_, memory_).make();
    if (plan) {
        memory_.frontierGain = plan->unknownGain;
        memory_.tearGain = plan->tearGain;
        memory_.doubtGain = plan->coarseGain;
        memory_.target = plan->path.back().translation;
    }
    return plan;
}

}  // namespace riftmap
