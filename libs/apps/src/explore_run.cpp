// SPDX-License-Identifier: BSD-3-Clause
#include "explore_run.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <sstream>
#include <utility>

#include "cutaway_picture.h"
#include "riftmap/apps/explore_progress.h"
#include "riftmap/apps/explore_report.h"
#include "riftmap/apps/pictures.h"
#include "riftmap/core/file.h"
#include "riftmap/eval/map_surface.h"
#include "riftmap/planner/paper_view_planner.h"

namespace riftmap {

namespace {

std::string deltaName(double delta) {
    const double mm = 1000 * delta;
    const double number = mm < 9.9 ? mm : mm / 10;
    return std::to_string(std::lround(number)) + (mm < 9.9 ? "mm" : "cm");
}

Eigen::AlignedBox3d boxAround(const TriangleMesh& mesh) {
    const Bounds b = bounds(mesh);
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(0.02 * b.size().maxCoeff() + 0.01);
    return {b.min - margin, b.max + margin};
}

/// Points of a view, every fourth pixel along each axis: for planners that keep a voxel map.
std::vector<Eigen::Vector3f> cloudOf(const View& view) {
    std::vector<Eigen::Vector3f> cloud;
    for (int row = 0; row < view.disparity.height; row += 2) {
        for (int column = 0; column < view.disparity.width; column += 2) {
            if (view.disparity.valid(column, row)) {
                const auto d = static_cast<double>(view.disparity.at(column, row));
                const Eigen::Vector3d p =
                    view.world_T_camera * view.camera.backProject(column, row, d);
                cloud.push_back(p.cast<float>());
            }
        }
    }
    return cloud;
}

/// One of the views sources of libs/eval in the loop.
class BaselinePlanner : public ViewPlanner {
 public:
    BaselinePlanner(std::string name, std::unique_ptr<ViewSource> source,
                    const SimulatedPlatform& platform, const std::vector<Eigen::Vector3f>& cloud)
        : name_(std::move(name)), source_(std::move(source)), platform_(platform), cloud_(cloud) {}

    std::string name() const override { return name_; }
    std::optional<ViewPlan> next(Knowledge& /*knowledge*/) override {
        BaselineState state;
        state.pose = platform_.pose();
        state.camera = platform_.camera();
        state.limits = platform_.limits();
        state.cloud = cloud_;
        state.segmentClear = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
            return platform_.rayCaster().sweptClear(a, b, state.limits.clearance + 1e-3);
        };
        auto path = source_->next(state);
        if (!path || path->empty()) {
            return std::nullopt;
        }
        ViewPlan plan;
        plan.path = std::move(*path);
        return plan;
    }

 private:
    std::string name_;
    std::unique_ptr<ViewSource> source_;
    const SimulatedPlatform& platform_;
    const std::vector<Eigen::Vector3f>& cloud_;
};

}  // namespace

ExploreRun::ExploreRun(ExploreProgram& program, RunDirectory& directory, bool resumed)
    : program_(program),
      directory_(directory),
      platform_(makePlatform(program.simulation_, program.seed())),
      map_(program.graph_, program.stereo_),
      builder_(program.stereo_),
      resumed_(resumed),
      config_(program.table().dump()) {
    PlannerOptions options = program.planner_;
    if (program.explore_.knownBox) {
        target_ = boxAround(platform_->world().mesh);
        if (options.surfaceBox.empty()) {
            for (const Eigen::Vector3d& corner : {target_.min(), target_.max()}) {
                options.surfaceBox.insert(options.surfaceBox.end(),
                                          {corner.x(), corner.y(), corner.z()});
            }
        }
    }
    if (program.explore_.judge) {
        makeJudge();
    }
    planner_ = makePlanner();
    if (resumed) {
        record_ = salvageRecord(directory, program.explore_.rawlog,
                                judge_ ? judge_->deltas() : std::vector<double>());
    }
    const auto mode = resumed ? CsvWriter::Mode::kAppend : CsvWriter::Mode::kNew;
    recorder_ =
        std::make_unique<RunRecorder>(directory, program.explore_.judge, mode, record_.seconds());
    replay_ = std::make_unique<ReplayingPlatform>(*platform_, directory, record_.observations);
    if (judge_) {
        std::vector<std::string> names = {"view", "path_length_m", "expected_gain_m2"};
        for (const double delta : judge_->deltas()) {
            names.push_back("c_obs_" + deltaName(delta));
            names.push_back("c_all_" + deltaName(delta));
        }
        curve_ = std::make_unique<CsvWriter>(directory.file("coverage.csv"), names, mode);
    }
    gains_ = std::make_unique<CsvWriter>(
        directory.file("gains.csv"),
        std::vector<std::string>{"view", "expected_tears_m2", "expected_finer_m2",
                                 "expected_unknown_m2", "new_m2", "well_known_m2",
                                 "expected_views_left", "expected_share"},
        mode);
    if (program.explore_.rawlog) {
        rawlog_ = std::make_unique<RawlogWriter>(
            directory.file("run.rawlog"), RawlogWriter::Images::kExternal,
            resumed ? RawlogWriter::Mode::kAppend : RawlogWriter::Mode::kNew);
        // riftmap-build config_build.ini run.rawlog makes the same map of it.
        OptionTable build;
        program.stereo_.describe(build);
        program.graph_.describe(build);
        writeAtomically(directory.file("config_build.ini"),
                        [&](std::ostream& out) { out << build.dump(); });
    }
    explorer_ = std::make_unique<SurfaceExplorer>(
        *replay_, graph(), *planner_, options, program.stop_,
        [this](const StereoObservation& o) { return builder_.build(o); },
        [this](StereoObservation& o) { record(o); },
        [this](const ExploreStep& step, const Knowledge& k) { onStep(step, k); });
}

void ExploreRun::makeJudge() {
    program_.eval_.resolveCache();
    const ViewSpace space =
        viewSpaceOf(platform_->limits(), platform_->camera(), platform_->pose().translation);
    judge_ = std::make_unique<CoverageJudge>(platform_->world().mesh, platform_->rayCaster(), space,
                                             program_.eval_,
                                             program_.progressOf("what can be seen:", "looks"));
    tracker_ = std::make_unique<CoverageTracker>(*judge_);
}

/// Into the rawlog with it; the map is made of what a reader will see.
void ExploreRun::record(StereoObservation& observation) {
    if (rawlog_ && !replay_->replayed()) {
        observation.world_T_camera = rawlog_->write(observation);
    }
}

std::unique_ptr<ViewPlanner> ExploreRun::makePlanner() {
    using Kind = ExploreOptions::Planner;
    const auto planner = [&](const std::string& name, std::unique_ptr<ViewSource> source) {
        return std::make_unique<BaselinePlanner>(name, std::move(source), *platform_, cloud_);
    };
    const auto baseline = [&](const std::string& name) {
        return planner(name, makeBaseline(name, program_.baseline_, target_, program_.seed()));
    };
    switch (program_.explore_.planner) {
        case Kind::kPaper:
            return std::make_unique<PaperViewPlanner>(program_.paper_);
        case Kind::kRandom:
            return baseline("random");
        case Kind::kOrbit:
            return baseline("orbit");
        case Kind::kLawnmower:
            return baseline("lawnmower");
        case Kind::kSphere:
            return baseline("sphere");
        case Kind::kOctomapFrontier:
            return baseline("octomap_frontier");
        case Kind::kForesight:
            if (!judge_) {
                throw ConfigError(
                    "[Explore] planner = foresight knows the surface from the judge: it needs "
                    "judge = true");
            }
            return planner("foresight", makeForesight(*judge_, platform_->rayCaster(),
                                                      program_.baseline_, program_.seed()));
        case Kind::kRiftmap:
            break;
    }
    return std::make_unique<RiftPlanner>();
}

/// Index of the headline distance among those that coverage is taken at.
std::size_t ExploreRun::headlineIndex() const {
    std::size_t i = 0;
    while (i + 1 < judge_->deltas().size() && judge_->deltas()[i] < judge_->headline() - 1e-9) {
        ++i;
    }
    return i;
}

void ExploreRun::collectVertices() {
    points_.clear();
    normals_.clear();
    colours_.clear();
    points_.reserve(graph().vertexCount());
    graph().forEachVertex([&](VertexId id) {
        const Vertex v = graph().vertex(id);
        points_.push_back(v.position);
        normals_.push_back(v.normal);
        colours_.push_back(v.rgb);
    });
}

std::vector<Coverage> ExploreRun::coverageNow() {
    const float nowhere = std::numeric_limits<float>::quiet_NaN();
    points_.assign(graph().idLimit(), Eigen::Vector3f::Constant(nowhere));
    graph().forEachVertex([&](VertexId id) { points_[id] = graph().position(id); });
    return tracker_->update(points_);
}

/// As recorded, or measured now and written down. With the digits of the file in both cases, so
/// that what is made of them does not tell a resumed run from another.
std::vector<Coverage> ExploreRun::coverageAfter(const ExploreStep& step) {
    if (step.view < record_.coverage.size()) {
        return record_.coverage[step.view];
    }
    std::vector<Coverage> coverage = coverageNow();
    std::vector<Field> fields = {step.view, step.pathLength, step.gain};
    for (Coverage& c : coverage) {
        fields.emplace_back(c.cObs);
        c.cObs = std::stod(fields.back().text());
        fields.emplace_back(c.cAll);
        c.cAll = std::stod(fields.back().text());
    }
    curve_->row(fields);
    return coverage;
}

void ExploreRun::onStep(const ExploreStep& measured, const Knowledge& knowledge) {
    const bool known = measured.view < record_.rows.size();
    ExploreStep step = measured;
    if (measured.view >= record_.views()) {
        takeOver();
    }
    if (known) {  // the times of then
        const StepRow& then = record_.rows[step.view];
        step.stereoMs = then.stereoMs;
        step.mergeMs = then.mergeMs;
        step.riftsMs = then.riftsMs;
        step.planMs = then.planMs;
        step.seconds = then.seconds;
    }
    taken_.push_back(step.input->world_T_camera);
    if (program_.explore_.planner != ExploreOptions::Planner::kRiftmap) {
        cloud_ = cloudOf(*step.input);
    }
    StepFigures figures{step, {}, knowledge.ledger().counts()[0]};
    figures.step.input = nullptr;
    StepRow row;
    row.time_ns = step.input->time_ns;
    row.world_T_camera = step.input->world_T_camera;
    row.rifts = explorer_->rifts().counts();
    row.pathLength = step.pathLength;
    row.stereoMs = step.stereoMs;
    row.mergeMs = step.mergeMs;
    row.riftsMs = step.riftsMs;
    row.planMs = step.planMs;
    row.seconds = step.seconds;
    if (judge_) {
        figures.coverage = coverageAfter(step);
        row.coverage = figures.coverage[headlineIndex()].cObs;
    }
    history_.push_back(std::move(figures));
    const auto ahead = forecastNow(knowledge.minGain());
    if (known) {
        recorder_->stepAgain(row);
    } else {
        constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
        gains_->row({step.view, step.gain - step.coarseGain - step.unknownGain, step.coarseGain,
                     step.unknownGain, step.newArea, step.wellKnownArea,
                     ahead ? ahead->viewsLeft : kNone, ahead ? ahead->share : kNone});
        recorder_->step(graph(), row);
    }
    writePictureOfView(history_.size());
    if (program_.progress()) {
        showProgress(row, step, ahead);
    }
}

/// Every so many views, if that was asked for and it is not there yet.
void ExploreRun::writePictureOfView(std::size_t number) {
    const auto every = static_cast<std::size_t>(program_.explore_.pictureEvery);
    const auto file = directory_.file("map_" + std::to_string(number) + ".png");
    const bool isThere = number <= record_.rows.size() && std::filesystem::exists(file);
    if (every > 0 && number % every == 0 && !isThere) {
        collectVertices();
        writePicture(file, cutawayPicture(points_, normals_, colours_, taken_));
    }
}

std::optional<Forecast> ExploreRun::forecastNow(double leastGain) const {
    std::vector<double> expected, seen;
    for (const StepFigures& f : history_) {
        expected.push_back(f.step.gain);
        seen.push_back(f.step.newArea);
    }
    return forecast(expected, seen, leastGain);
}

void ExploreRun::showProgress(const StepRow& row, const ExploreStep& step,
                              const std::optional<Forecast>& ahead) const {
    std::ostringstream line;
    line.setf(std::ios::fixed);
    line.precision(1);
    line << "view " << step.view + 1 << ", " << step.pathLength << " m, " << graph().vertexCount()
         << " vertices, rifts:";
    for (std::size_t i = 0; i < kRiftStates; ++i) {
        if (static_cast<RiftState>(i) != RiftState::kResolved && (i == 0 || row.rifts[i] > 0)) {
            line << ' ' << row.rifts[i] << ' ' << kRiftStateNames[i];
        }
    }
    line.precision(3);
    line << ", gain " << step.gain << " m2, plan " << std::lround(step.planMs) << " merge "
         << std::lround(step.mergeMs) << " ms";
    line.precision(2);
    for (const Coverage& c : history_.back().coverage) {
        line << ", " << 100 * c.cObs << " % at " << deltaName(c.delta);
    }
    if (ahead) {
        std::vector<double> seconds;
        for (const StepFigures& f : history_) {
            seconds.push_back(f.step.seconds);
        }
        line << "; "
             << forecastText(*ahead, seconds, static_cast<std::size_t>(program_.stop_.maxViews));
    }
    std::cerr << line.str() << '\n';
}

void ExploreRun::run(const std::atomic<bool>& interrupt) {
    try {
        explorer_->run(interrupt, record_.seconds(), record_.views());
    } catch (const CollisionError& e) {
        finish(e.what());
        throw;
    }
    if (explorer_->stopReason() == "interrupted" && explorer_->views() < record_.views()) {
        program_.stopReason = explorer_->stopReason();
        std::cerr << directory_.path().string()
                  << ": interrupted before there was a new view; nothing is changed\n";
        if (rawlog_) {
            rawlog_->finish();
        }
        return;
    }
    finish({});
}

/// From the first new view on it is the directory of a run that has not ended, with these limits.
void ExploreRun::takeOver() {
    if (resumed_) {
        std::filesystem::remove(directory_.file("summary.yaml"));
        writeAtomically(directory_.file("config_used.ini"),
                        [&](std::ostream& out) { out << config_; });
    }
    resumed_ = false;
}

void ExploreRun::finish(const std::string& error) {
    takeOver();
    program_.stopReason = error.empty() ? explorer_->stopReason() : "collision";
    program_.views = explorer_->views();
    program_.pathLength = explorer_->pathLength();
    program_.collisions = platform_->collisions();
    if (rawlog_) {
        rawlog_->finish();
    }
    collectVertices();
    SceneExtras scene;
    scene.taken = taken_;
    const YamlMap more = figures(error);
    recorder_->finish(map_, certificate(), scene, program_.stopReason, more);
    writeCells();
    writePicture(directory_.file("map.png"), cutawayPicture(points_, normals_, colours_, taken_));
    writeReport();
}

std::vector<RiftRow> ExploreRun::certificate() const {
    std::vector<RiftRow> rows;
    for (const auto& [id, r] : explorer_->rifts().rifts()) {
        RiftRow row;
        row.id = id;
        row.state = nameOf(r.state);
        row.reason = r.reason;
        row.type = kindNames(r.kinds);
        row.centre = r.centre;
        row.normal = r.normal;
        row.openVertices = r.openVertices;
        row.edges = r.highEdges;
        row.attempts = r.tries.size();
        row.extent = r.extent;
        row.rim = r.rim;
        row.coarse = r.coarse;
        row.cells = r.cells.size();
        row.firstView = r.firstView;
        row.lastView = explorer_->rifts().lastView(r);
        row.parents.assign(r.parents.begin(), r.parents.end());
        row.joined.assign(r.joined.begin(), r.joined.end());
        rows.push_back(row);
    }
    return rows;
}

/// The pieces of the rifts that are left: places for whoever checks the certificate.
void ExploreRun::writeCells() const {
    CsvWriter table(directory_.file("rift_cells.csv"),
                    {"rift", "state", "reason", "type", "x", "y", "z", "nx", "ny", "nz",
                     "open_vertices", "edges", "attempts", "rim_m", "coarse_m2", "hidden_m2"});
    const auto& owners = explorer_->rifts().owners();
    for (const auto& [key, r] : explorer_->knowledge().ledger().records()) {
        if (r.state == RiftState::kResolved) {
            continue;
        }
        const SurfaceCell& c = r.cell;
        table.row({owners.at(key), nameOf(r.state), r.reason, kindNames(c.kinds),
                   c.openPosition.x(), c.openPosition.y(), c.openPosition.z(), c.normal.x(),
                   c.normal.y(), c.normal.z(), c.open, c.highEdges, r.attempts.size(), c.rim,
                   c.coarse, c.hidden});
    }
}

/// What the summary tells beyond what every mapping run tells.
YamlMap ExploreRun::figures(const std::string& error) {
    YamlMap summary;
    summary.set("planner", planner_->name());
    summary.set("collisions", program_.collisions);
    if (!error.empty()) {
        summary.set("error", error);
    }
    if (judge_ && !history_.empty()) {
        const std::vector<Eigen::Vector3f> rims = rimsOf(map_.graph());
        std::vector<Eigen::Vector3f> verdicts;
        for (const auto& [key, r] : explorer_->knowledge().ledger().records()) {
            if (r.state == RiftState::kUnreachable || r.state == RiftState::kUnobservable) {
                verdicts.push_back(r.cell.openPosition);
            }
        }
        program_.coverage = judge_->evaluate(points_, normals_, &rims, verdicts);
        for (const DistanceFigures& f : program_.coverage.at) {
            const std::string d = deltaName(f.delta);
            summary.set("c_obs_" + d, f.cObs);
            summary.set("c_all_" + d, f.cAll);
            summary.set("c_obs_strict_" + d, f.cObsStrict);
            summary.set("accuracy_" + d, f.accuracy);
            summary.set("f_score_" + d, f.fScore);
            summary.set("spurious_" + d, f.spurious);
        }
        summary.set("accuracy_headline", program_.coverage.atDelta(judge_->headline()).accuracy);
        summary.set("error_median_m", program_.coverage.errorMedian);
        summary.set("error_p95_m", program_.coverage.errorP95);
        summary.set("explained", program_.coverage.explained);
        summary.set("certificate_right", program_.coverage.certificateRight);
        summary.set("certificate_verdicts", program_.coverage.verdicts);
        CoverageCurve curve;
        for (const StepFigures& f : history_) {
            curve.add(f.step.pathLength, f.coverage[headlineIndex()].cObs);
        }
        summary.set("headline_delta_m", judge_->headline());
        summary.set("auc_10", curve.areaUnderCurve(10));
        summary.set("auc_30", curve.areaUnderCurve(30));
        for (const int share : {90, 95, 99}) {
            summary.set("views_to_" + std::to_string(share), curve.viewsTo(share / 100.0));
            summary.set("path_to_" + std::to_string(share) + "_m", curve.metresTo(share / 100.0));
        }
    }
    return summary;
}

void ExploreRun::writeReport() const {
    ExploreReport report;
    report.title = "Riftmap explored " + platform_->world().name;
    report.points = points_;
    report.colours = colours_;
    for (const Pose& pose : taken_) {
        report.path.push_back(pose.translation.cast<float>());
    }
    report.pictures = {directory_.file("map.png")};
    const auto counts = explorer_->rifts().counts();
    for (const auto& [key, r] : explorer_->knowledge().ledger().records()) {
        if (r.state != RiftState::kResolved && r.state != RiftState::kBelowResolution) {
            report.rifts.push_back(r.cell.openPosition);
        }
    }
    const auto fact = [&](const std::string& name, const Field& value) {
        report.facts.emplace_back(name, value.text());
    };
    fact("stop reason", program_.stopReason);
    fact("views", explorer_->views());
    fact("path [m]", explorer_->pathLength());
    fact("vertices", graph().vertexCount());
    fact("surface [m2]", graph().surfaceArea());
    for (std::size_t i = 0; i < counts.size(); ++i) {
        fact(std::string("rifts ") + nameOf(static_cast<RiftState>(i)), counts[i]);
    }
    for (const DistanceFigures& f : program_.coverage.at) {
        fact("covered within " + deltaName(f.delta) + " (observable)", f.cObs);
        fact("vertices within " + deltaName(f.delta) + " of the surface", f.accuracy);
    }
    ReportDiagram byView{"Covered share of the observable surface", "views", "share", {}};
    ReportDiagram byPath{"Covered share of the observable surface", "path [m]", "share", {}};
    ReportDiagram open{"Cells of open rifts", "views", "cells", {{"open", {}, {}}}};
    ReportDiagram time{"Time a view", "views", "ms", {{"plan", {}, {}}, {"merge", {}, {}}}};
    for (const StepFigures& f : history_) {
        const double n = static_cast<double>(f.step.view + 1);
        for (std::size_t i = 0; i < f.coverage.size(); ++i) {
            if (byView.curves.size() <= i) {
                byView.curves.push_back({deltaName(f.coverage[i].delta), {}, {}});
                byPath.curves.push_back(byView.curves.back());
            }
            byView.curves[i].x.push_back(n);
            byView.curves[i].y.push_back(f.coverage[i].cObs);
            byPath.curves[i].x.push_back(f.step.pathLength);
            byPath.curves[i].y.push_back(f.coverage[i].cObs);
        }
        open.curves[0].x.push_back(n);
        open.curves[0].y.push_back(static_cast<double>(f.open));
        time.curves[0].x.push_back(n);
        time.curves[0].y.push_back(f.step.planMs);
        time.curves[1].x.push_back(n);
        time.curves[1].y.push_back(f.step.mergeMs);
    }
    if (judge_) {
        report.diagrams = {byView, byPath};
    }
    report.diagrams.push_back(open);
    report.diagrams.push_back(time);
    writeExploreReport(directory_.file("report.html"), report);
}

}  // namespace riftmap
