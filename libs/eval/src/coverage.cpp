// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/coverage.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "riftmap/core/parallel.h"
#include "riftmap/core/union_find.h"
#include "riftmap/eval/point_index.h"

namespace riftmap {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kReach = 0.05;   ///< from an uncovered sample to the next, and to a rift [m]
constexpr double kBeside = 0.03;  ///< from a tear to what one could still see there [m]

struct Distances {
    std::vector<double> deltas;
    double headline;
};

Distances protocolDistances(WorldKind kind) {
    switch (kind) {
        case WorldKind::kObject:
            return {{0.002, 0.005, 0.01}, 0.005};
        case WorldKind::kOutdoor:
            return {{0.05, 0.1}, 0.1};
        default:
            return {{0.01, 0.02, 0.05}, 0.02};
    }
}

double share(std::size_t part, std::size_t whole) {
    return whole == 0 ? kNaN : static_cast<double>(part) / static_cast<double>(whole);
}

/// q-quantile of values, which are reordered; the lower of two middle ones. NaN if empty.
double quantile(std::vector<float>& values, double q) {
    if (values.empty()) {
        return kNaN;
    }
    const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return static_cast<double>(values[static_cast<std::size_t>(at)]);
}

}  // namespace

const DistanceFigures& CoverageReport::atDelta(double delta) const {
    for (const DistanceFigures& f : at) {
        if (std::abs(f.delta - delta) < 1e-9) {
            return f;
        }
    }
    throw std::out_of_range("no figures at " + std::to_string(delta) + " m");
}

CoverageJudge::CoverageJudge(const TriangleMesh& mesh, const RayCaster& caster,
                             const ViewSpace& space, const EvalOptions& options,
                             const OnProgress& progress)
    : options_(options),
      caster_(&caster),
      samples_(groundTruthSamples(mesh, options)),
      observable_(observableSet(caster, space, samples_, options, progress)),
      deltas_(options.deltas),
      headline_(options.headline),
      meshArea_(area(mesh)) {
    const Distances usual = protocolDistances(worldKind(mesh, options.kind));
    if (deltas_.empty()) {
        deltas_ = usual.deltas;
    }
    std::sort(deltas_.begin(), deltas_.end());
    if (!(deltas_.front() > 0)) {
        throw std::invalid_argument("Eval.deltas must be positive");
    }
    if (headline_ <= 0) {
        const bool asked =
            std::find(deltas_.begin(), deltas_.end(), usual.headline) != deltas_.end();
        headline_ = asked ? usual.headline : deltas_[deltas_.size() / 2];
    }
    const Bounds box = bounds(mesh);
    const auto reach = static_cast<float>(std::max(deltas_.back(), headline_) * 1.01);
    bounds_ = Eigen::AlignedBox3f(box.min.cast<float>().array() - reach,
                                  box.max.cast<float>().array() + reach);
}

std::vector<float> CoverageJudge::sampleDistances(std::span<const Eigen::Vector3f> vertices) const {
    const auto reach = coverageLimit(std::max(deltas_.back(), headline_));
    const PointIndex index(vertices, reach, bounds_);
    std::vector<float> out(samples_.points.size());
    parallelForEach(out.size(), 64, [&](std::size_t i) {
        const auto near = index.nearest(samples_.points[i], reach);
        out[i] = near ? std::sqrt(near->squaredDistance) : kInfinity;
    });
    return out;
}

std::vector<Coverage> CoverageJudge::coverage(std::span<const Eigen::Vector3f> vertices) const {
    const std::vector<float> distances = sampleDistances(vertices);
    std::vector<Coverage> out;
    for (const double delta : deltas_) {
        const auto limit = coverageLimit(delta);
        std::size_t all = 0;
        std::size_t seen = 0;
        for (std::size_t i = 0; i < distances.size(); ++i) {
            const bool covered = distances[i] <= limit;
            all += covered;
            seen += covered && observable_.observable[i] != 0;
        }
        out.push_back({delta, share(seen, observable_.count), share(all, distances.size())});
    }
    return out;
}

std::vector<float> CoverageJudge::vertexErrors(std::span<const Eigen::Vector3f> vertices) const {
    std::vector<float> out(vertices.size(), kInfinity);
    parallelForEach(vertices.size(), 64, [&](std::size_t i) {
        if (!vertices[i].allFinite()) {
            return;
        }
        // A small ball first: looking for the nearest triangle far away is the slow case.
        for (double radius = 2 * headline_; radius < 1e9; radius *= 2) {
            if (const auto near = caster_->closest(vertices[i].cast<double>(), radius)) {
                out[i] = static_cast<float>(near->distance);
                return;
            }
        }
    });
    return out;
}

std::vector<std::uint8_t> CoverageJudge::strictlyCovered(std::span<const Eigen::Vector3f> vertices,
                                                         std::span<const Eigen::Vector3f> normals,
                                                         double delta) const {
    const auto reach = coverageLimit(delta);
    const PointIndex index(vertices, reach, bounds_);
    std::vector<std::uint8_t> out(samples_.points.size());
    parallelForEach(out.size(), 64, [&](std::size_t i) {
        const Eigen::Vector3f& p = samples_.points[i];
        const Eigen::Vector3f& n = observable_.normals[i];
        out[i] = index.anyWithin(p, reach, [&](std::uint32_t v, float) {
            // The margin at the ends leaves room for the vertex's own error.
            return n.dot(normals[v]) > 0 &&
                   !caster_->occluded(p.cast<double>(), vertices[v].cast<double>(), delta / 10);
        });
    });
    return out;
}

CoverageReport CoverageJudge::evaluate(std::span<const Eigen::Vector3f> vertices,
                                       std::span<const Eigen::Vector3f> normals,
                                       const std::vector<Eigen::Vector3f>* rifts,
                                       const std::vector<Eigen::Vector3f>& verdicts) const {
    CoverageReport report;
    report.headline = headline_;
    report.samples = samples_.points.size();
    report.observable = observable_.count;
    std::vector<float> errors = vertexErrors(vertices);
    std::erase_if(errors, [](float e) { return !std::isfinite(e); });
    report.vertices = errors.size();
    const bool strict = options_.strict && !vertices.empty() && normals.size() == vertices.size();
    for (const Coverage& plain : coverage(vertices)) {
        DistanceFigures f;
        f.delta = plain.delta;
        f.cObs = plain.cObs;
        f.cAll = plain.cAll;
        f.cObsStrict = f.cAllStrict = kNaN;
        if (strict) {
            const auto covered = strictlyCovered(vertices, normals, f.delta);
            std::size_t all = 0;
            std::size_t seen = 0;
            for (std::size_t i = 0; i < covered.size(); ++i) {
                all += covered[i];
                seen += covered[i] != 0 && observable_.observable[i] != 0;
            }
            f.cObsStrict = share(seen, report.observable);
            f.cAllStrict = share(all, report.samples);
        }
        const auto within = [&](double limit) {
            const auto bound = coverageLimit(limit);
            return static_cast<std::size_t>(
                std::count_if(errors.begin(), errors.end(), [&](float e) { return e <= bound; }));
        };
        f.accuracy = share(within(f.delta), errors.size());
        f.spurious = share(errors.size() - within(3 * f.delta), errors.size());
        f.fScore = f.cObs + f.accuracy > 0 ? 2 * f.cObs * f.accuracy / (f.cObs + f.accuracy) : 0;
        report.at.push_back(f);
    }
    if (!errors.empty()) {
        double sum = 0;
        for (const float e : errors) {
            sum += static_cast<double>(e);
        }
        report.errorMean = sum / static_cast<double>(errors.size());
        report.errorMedian = quantile(errors, 0.5);
        report.errorP95 = quantile(errors, 0.95);
    }
    // One must be able to step from sample to sample: farther where they are sparse.
    const double step = 2 * std::sqrt(meshArea_ / static_cast<double>(report.samples));
    const std::vector<float> distances = sampleDistances(vertices);
    const double reach = std::max(kReach, step);
    // What is uncovered has no vertex within the headline distance, so no rim either.
    if (rifts != nullptr && reach > headline_) {
        report.explained = explainedShare(distances, headline_, *rifts, reach);
    }
    report.verdicts = verdicts.size();
    const auto right = trueVerdicts(distances, headline_, verdicts, std::max(kBeside, step));
    report.certificateRight =
        share(static_cast<std::size_t>(std::count(right.begin(), right.end(), 1)), right.size());
    return report;
}

/// The observable samples farther than delta from the map.
std::vector<Eigen::Vector3f> CoverageJudge::stillToSee(const std::vector<float>& sampleDistances,
                                                       double delta) const {
    const auto limit = coverageLimit(delta);
    std::vector<Eigen::Vector3f> open;
    for (std::size_t i = 0; i < sampleDistances.size(); ++i) {
        if (observable_.observable[i] != 0 && !(sampleDistances[i] <= limit)) {
            open.push_back(samples_.points[i]);
        }
    }
    return open;
}

std::vector<std::uint8_t> CoverageJudge::trueVerdicts(const std::vector<float>& sampleDistances,
                                                      double delta,
                                                      const std::vector<Eigen::Vector3f>& places,
                                                      double reach) const {
    const std::vector<Eigen::Vector3f> open = stillToSee(sampleDistances, delta);
    const auto radius = static_cast<float>(reach);
    const PointIndex index(open, radius);
    std::vector<std::uint8_t> out;
    out.reserve(places.size());
    for (const Eigen::Vector3f& place : places) {
        out.push_back(index.nearest(place, radius) ? 0 : 1);
    }
    return out;
}

double CoverageJudge::explainedShare(const std::vector<float>& sampleDistances, double delta,
                                     const std::vector<Eigen::Vector3f>& rifts,
                                     double reach) const {
    const std::vector<Eigen::Vector3f> open = stillToSee(sampleDistances, delta);
    if (open.empty()) {
        return 1;
    }
    const auto radius = static_cast<float>(reach);
    const PointIndex index(open, radius);
    const PointIndex rims(rifts, radius);
    UnionFind groups(open.size());
    for (std::uint32_t i = 0; i < open.size(); ++i) {
        index.anyWithin(open[i], radius, [&](std::uint32_t other, float) {
            if (other < i) {
                groups.unite(i, other);
            }
            return false;
        });
    }
    std::vector<std::uint8_t> explained(open.size());
    for (std::uint32_t i = 0; i < open.size(); ++i) {
        if (rims.nearest(open[i], radius)) {
            explained[groups.root(i)] = 1;
        }
    }
    std::size_t count = 0;
    for (std::uint32_t i = 0; i < open.size(); ++i) {
        count += explained[groups.root(i)];
    }
    return share(count, open.size());
}

void CoverageCurve::add(double pathMetres, double coverage) {
    path_.push_back(pathMetres);
    coverage_.push_back(coverage);
}

double CoverageCurve::areaUnderCurve(std::size_t views) const {
    if (coverage_.empty() || views == 0) {
        return 0;
    }
    double sum = 0;
    for (std::size_t i = 0; i < views; ++i) {
        sum += coverage_[std::min(i, coverage_.size() - 1)];
    }
    return sum / static_cast<double>(views);
}

double CoverageCurve::viewsTo(double coverage) const {
    for (std::size_t i = 0; i < coverage_.size(); ++i) {
        if (coverage_[i] >= coverage) {
            return static_cast<double>(i + 1);
        }
    }
    return kNaN;
}

double CoverageCurve::metresTo(double coverage) const {
    const double views = viewsTo(coverage);
    return std::isnan(views) ? kNaN : path_[static_cast<std::size_t>(views) - 1];
}

}  // namespace riftmap
