// SPDX-License-Identifier: BSD-3-Clause
// What doc/coverage_protocol.md defines: how much of a known surface a map holds, and how well.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "riftmap/eval/eval_options.h"
#include "riftmap/eval/observable.h"
#include "riftmap/eval/samples.h"

namespace riftmap {

/// Figures at one distance; shares in [0, 1], NaN where they do not exist.
struct DistanceFigures {
    double delta = 0;       ///< [m]
    double cObs = 0;        ///< covered share of the observable samples
    double cAll = 0;        ///< covered share of all samples
    double cObsStrict = 0;  ///< same side and nothing between; NaN without normals
    double cAllStrict = 0;  ///< NaN without normals
    double accuracy = 0;  ///< share of the vertices within delta of the mesh; NaN without vertices
    double fScore = 0;    ///< harmonic mean of cObs and accuracy
    double spurious = 0;  ///< share of the vertices farther than 3 delta from the mesh
};

/// Everything coverage_protocol.md asks of one map. Distances [m].
struct CoverageReport {
    std::vector<DistanceFigures> at;  ///< by ascending delta
    double headline = 0;              ///< the delta that the explained share is taken at [m]
    std::size_t vertices = 0;         ///< of the map, those not finite left out
    std::size_t samples = 0;          ///< of the mesh
    std::size_t observable = 0;       ///< of the samples
    double errorMedian = std::numeric_limits<double>::quiet_NaN();  ///< vertex to mesh
    double errorP95 = std::numeric_limits<double>::quiet_NaN();
    double errorMean = std::numeric_limits<double>::quiet_NaN();
    /// Share of the uncovered observable samples that the listed rifts explain; 1 where nothing is
    /// uncovered. NaN without a list, and in any case where the headline distance is not below the
    /// reach of 5 cm (or two spacings of the samples): no vertex of the map can lie so near what is
    /// uncovered, and of lists of other places nothing is told either, so that figures compare.
    double explained = std::numeric_limits<double>::quiet_NaN();
    /// Share of the verdicts "no camera can close this tear" that are true (trueVerdicts());
    /// NaN without such verdicts.
    double certificateRight = std::numeric_limits<double>::quiet_NaN();
    std::size_t verdicts = 0;  ///< their number

    /// The figures at this distance. Throws std::out_of_range if it was not asked for.
    const DistanceFigures& atDelta(double delta) const;
};

/// Coverage alone, quickly: after every view of an exploring run.
struct Coverage {
    double delta = 0;  ///< [m]
    double cObs = 0, cAll = 0;
};

/// A vertex at this distance [m] or nearer covers at delta: a float's rounding must not lose one
/// that lies exactly there.
inline float coverageLimit(double delta) {
    return static_cast<float>(delta * (1 + 1e-6));
}

/// Judges maps of one world as seen from one view space. The observable set is computed once, at
/// construction, or read from the cache. Reading is thread-safe; the results are the same bytes
/// for any number of threads.
class CoverageJudge {
 public:
    /// Throws std::invalid_argument for an empty mesh, std::runtime_error for a start inside a
    /// wall or outside the box. `mesh` need not outlive the judge; `caster` must.
    /// `progress`: see observableSet().
    CoverageJudge(const TriangleMesh& mesh, const RayCaster& caster, const ViewSpace& space,
                  const EvalOptions& options, const OnProgress& progress = {});

    const SurfaceSamples& samples() const { return samples_; }
    const ObservableSet& observable() const { return observable_; }
    const EvalOptions& options() const { return options_; }
    const std::vector<double>& deltas() const { return deltas_; }  ///< [m], ascending
    double headline() const { return headline_; }                  ///< [m]
    double meshArea() const { return meshArea_; }                  ///< [m^2]

    /// Plain coverage at every delta: 0.1 s for a million vertices on two threads. A map that grows
    /// view by view is what CoverageTracker is for.
    std::vector<Coverage> coverage(std::span<const Eigen::Vector3f> vertices) const;

    /// Everything. `normals`: of the vertices, or empty. `rifts`: places on the rims that the
    /// certificate lists (rift vertices or centres) [m]; null where there is no certificate.
    /// `verdicts`: centres of the tears that it calls unreachable or unobservable [m].
    CoverageReport evaluate(std::span<const Eigen::Vector3f> vertices,
                            std::span<const Eigen::Vector3f> normals,
                            const std::vector<Eigen::Vector3f>* rifts = nullptr,
                            const std::vector<Eigen::Vector3f>& verdicts = {}) const;

    /// Distance of every sample to the nearest vertex [m], infinite beyond the largest delta.
    std::vector<float> sampleDistances(std::span<const Eigen::Vector3f> vertices) const;
    /// Distance of every vertex to the mesh [m]; infinite for a vertex that is not finite.
    std::vector<float> vertexErrors(std::span<const Eigen::Vector3f> vertices) const;
    /// Of the observable samples farther than `delta` from the map, the share from which one
    /// comes within `reach` of a rift, walking over such samples at most `reach` apart.
    double explainedShare(const std::vector<float>& sampleDistances, double delta,
                          const std::vector<Eigen::Vector3f>& rifts, double reach = 0.05) const;
    /// A tear that no camera can close has nothing beside it that one could still see: 1 for each
    /// place without a sample within `reach` [m] of it that is observable but farther than `delta`
    /// from the map, else 0. (Observable: some pose of the view space sees it.)
    std::vector<std::uint8_t> trueVerdicts(const std::vector<float>& sampleDistances, double delta,
                                           const std::vector<Eigen::Vector3f>& places,
                                           double reach = 0.03) const;

 private:
    std::vector<Eigen::Vector3f> stillToSee(const std::vector<float>& sampleDistances,
                                            double delta) const;
    std::vector<std::uint8_t> strictlyCovered(std::span<const Eigen::Vector3f> vertices,
                                              std::span<const Eigen::Vector3f> normals,
                                              double delta) const;

    EvalOptions options_;
    const RayCaster* caster_;
    SurfaceSamples samples_;
    ObservableSet observable_;
    std::vector<double> deltas_;
    double headline_ = 0;
    double meshArea_ = 0;
    Eigen::AlignedBox3f bounds_;
};

/// How coverage grew over a run: a row a view. A run that stopped early holds its last value.
class CoverageCurve {
 public:
    void add(double pathMetres, double coverage);
    std::size_t views() const { return coverage_.size(); }
    /// Mean coverage over the first `views` views, in [0, 1]; 0 without any.
    double areaUnderCurve(std::size_t views) const;
    /// First view (from 1) with at least this coverage; NaN if never.
    double viewsTo(double coverage) const;
    /// Metres travelled by then; NaN if never.
    double metresTo(double coverage) const;

 private:
    std::vector<double> path_, coverage_;
};

}  // namespace riftmap
