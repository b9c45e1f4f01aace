// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/build_program.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <future>
#include <limits>
#include <memory>
#include <utility>

#include "riftmap/apps/interrupt.h"
#include "riftmap/apps/pictures.h"
#include "riftmap/apps/simplemap_writer.h"
#include "riftmap/core/progress.h"
#include "riftmap/core/tum.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {
namespace {

/// Milliseconds since it was made.
class Stopwatch {
 public:
    double ms() const {
        return std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
    }

 private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point start_ = Clock::now();
};

/// Every tear the recording showed: the last that is known of it, and whether it is still there.
class RiftHistory {
 public:
    void update(const std::vector<Rift>& rifts, std::size_t view) {
        for (auto& [id, row] : rows_) {
            if (row.state == "open") {
                row.state = "resolved";
                row.reason = "closed by view " + std::to_string(view);
            }
        }
        for (const auto& rift : rifts) {
            const auto [at, isNew] = rows_.try_emplace(rift.id);
            RiftRow& row = at->second;
            row.id = rift.id;
            row.firstView = isNew ? view : row.firstView;
            row.state = "open";
            row.reason = "still there when the recording ended";
            row.type = kindNames(rift.kinds);
            row.centre = rift.centre;
            row.normal = rift.normal;
            row.openVertices = rift.vertices.size();
            row.edges = rift.highEdges;
            row.lastView = view;
        }
        open_ = rifts.size();
    }

    RiftCounts counts() const {
        RiftCounts counts = {};
        counts.front() = open_;
        counts.back() = rows_.size() - open_;
        return counts;
    }

    std::vector<RiftRow> rows() const {
        std::vector<RiftRow> all;
        for (const auto& [id, row] : rows_) {
            all.push_back(row);
        }
        return all;
    }

 private:
    std::map<std::uint32_t, RiftRow> rows_;
    std::size_t open_ = 0;
};

std::optional<std::size_t> dominantOf(const PaperPlan& plan) {
    return plan.dominant == PaperPlan::kNone ? std::nullopt : std::optional(plan.dominant);
}

/// The end of a high edge of the rift that is nearest to its middle: the middle of a tear around
/// an object may lie far from any surface.
Eigen::Vector3d middleOf(const PixelGraph& graph, const Rift& rift) {
    Eigen::Vector3f best = rift.centre;
    float least = std::numeric_limits<float>::infinity();
    for (const auto id : rift.vertices) {
        const Eigen::Vector3f p = graph.position(id);
        if ((p - rift.centre).norm() < least) {
            least = (p - rift.centre).norm();
            best = p;
        }
    }
    return best.cast<double>();
}

}  // namespace

void BuildOutputOptions::describe(OptionTable& table) {
    table.section("Output", "What the run directory holds besides the map.");
    table.add("pictures", pictures, "PNG pictures of the disparity, the graph and the rifts.");
    table.add("simplemap", simplemap,
              "keyframes.simplemap: the rectified views for programs of MRPT.");
    table.add("plan", plan, "The dominant rift and the way to the view that would close it.");
}

BuildProgram::BuildProgram()
    : Program("riftmap-build", "Builds a pixel-graph map from a stereo rawlog or simplemap.",
              Config::kOptional) {}
BuildProgram::~BuildProgram() = default;

void BuildProgram::describe(OptionTable& table) {
    input_.describe(table);
    stereo_.describe(table);
    graph_.describe(table);
    planner_.describe(table);
    output_.describe(table);
}

void BuildProgram::arguments(CommandLine& line) {
    line.positional("RAWLOG", "stereo pairs: a .rawlog or a .simplemap");
    line.value("poses", 0, "FILE.tum", poses_, "poses in place of those inside the rawlog");
}

/// One run: everything that lives from the first view to the last.
class BuildProgram::Run {
 public:
    Run(BuildProgram& program, RunDirectory directory, ViewBuilder builder)
        : program_(program),
          directory_(std::move(directory)),
          recorder_(directory_, false),
          builder_(std::move(builder)),
          map_(program.graph_, program.stereo_) {
        if (program.output_.simplemap) {
            simplemap_ = std::make_unique<SimpleMapWriter>(directory_.file("keyframes.simplemap"));
        }
    }

    void add(const StereoObservation& observation) {
        StepRow row;
        row.time_ns = observation.time_ns;
        row.world_T_camera = observation.world_T_camera;
        const Stopwatch stereo;
        const View view = builder_.build(observation);
        row.stereoMs = stereo.ms();
        const Stopwatch merge;
        map_.graph().merge(view);
        row.mergeMs = merge.ms();
        const Stopwatch rifts;
        history_.update(graph().rifts(), recorder_.views());
        row.riftsMs = rifts.ms();
        row.rifts = history_.counts();
        if (!taken_.empty()) {
            pathLength_ +=
                (observation.world_T_camera.translation - taken_.back().translation).norm();
        }
        row.pathLength = pathLength_;
        taken_.push_back(observation.world_T_camera);
        if (taken_.size() == 1) {
            afterFirstView(view, row);
        }
        row.seconds = recorder_.seconds();
        recorder_.step(graph(), row);
        if (simplemap_) {
            simplemap_->add(observation);
        }
        lastTime_ = observation.time_ns;
    }

    std::size_t views() const { return recorder_.views(); }

    void finish(const std::string& stopReason) {
        program_.end = figures();
        SceneExtras scene;
        scene.taken = taken_;
        YamlMap more;
        if (program_.output_.plan) {
            program_.plan = plan();
            scene.planned = program_.plan.poses;
            scene.dominant = dominantOf(program_.plan);
            writePlan(more);
        }
        recorder_.finish(map_, history_.rows(), scene, stopReason, more);
        if (simplemap_) {
            simplemap_->finish();
        }
        if (program_.output_.pictures) {
            writePicture(directory_.file("rifts.png"), mapPicture(graph(), parts(program_.plan)));
        }
    }

 private:
    const PixelGraph& graph() const { return map_.graph(); }

    Figures figures() const {
        return {taken_.size(),       graph().rawPointCount(), graph().vertexCount(),
                graph().edgeCount(), graph().rifts().size(),  graph().surfaceArea()};
    }

    PaperPlan plan() { return planPaper(graph(), taken_.back(), program_.planner_, search_); }

    MapPictureParts parts(const PaperPlan& plan) const {
        MapPictureParts parts;
        parts.rifts = graph().rifts();
        parts.dominant = dominantOf(plan);
        parts.taken = taken_;
        parts.planned = plan.poses;
        return parts;
    }

    /// Figs. 1(b), 1(d) and 6(a): what a single view gives.
    void afterFirstView(const View& view, StepRow& row) {
        program_.firstView = figures();
        const Stopwatch planning;
        const PaperPlan first = program_.output_.plan ? plan() : PaperPlan();
        row.planMs = planning.ms();
        if (!program_.output_.pictures) {
            return;
        }
        writePicture(directory_.file("disparity.png"), disparityPicture(view.disparity));
        writePicture(directory_.file("rifts_first.png"), mapPicture(graph(), parts(first)));
        if (const auto dominant = dominantOf(first)) {
            const auto middle = middleOf(graph(), graph().rifts()[*dominant]);
            constexpr double kPixels = 26;  // half the width of the detail
            const double radius =
                kPixels * (view.world_T_camera.inverse() * middle).z() / view.camera.fx;
            writePicture(directory_.file("graph_detail.png"),
                         graphDetailPicture(graph(), middle, radius, view.world_T_camera));
        }
    }

    /// The way as a trajectory, a second from pose to pose.
    void writePlan(YamlMap& summary) const {
        const auto& plan = program_.plan;
        const auto dominant = dominantOf(plan);
        summary.set("dominant_rift",
                    dominant ? Field(graph().rifts()[*dominant].id) : Field("none"));
        summary.set("planned_path_m", plan.overGraph.length);
        std::vector<TimedPose> way;
        for (std::size_t i = 0; i < plan.poses.size(); ++i) {
            way.push_back(
                {lastTime_ + static_cast<std::int64_t>(i + 1) * 1'000'000'000, plan.poses[i]});
        }
        writeTum(directory_.file("planned_path.tum"), way);
    }

    BuildProgram& program_;
    RunDirectory directory_;
    RunRecorder recorder_;
    ViewBuilder builder_;
    PixelGraphMap map_;
    GraphSearch search_;
    RiftHistory history_;
    std::vector<Pose> taken_;
    double pathLength_ = 0;
    std::int64_t lastTime_ = 0;
    std::unique_ptr<SimpleMapWriter> simplemap_;
};

namespace {

/// As Table I of the paper. One column where there is one view.
void printTable(const BuildProgram::Figures& first, const BuildProgram::Figures& end) {
    const bool both = end.views > 1;
    const auto row = [both](const char* name, const std::string& a, const std::string& b) {
        std::printf("%-20s %14s %14s\n", name, a.c_str(), both ? b.c_str() : "");
    };
    const auto count = [&row](const char* name, std::size_t a, std::size_t b) {
        row(name, std::to_string(a), std::to_string(b));
    };
    const auto area = [](double squareMetres) {
        return Field(std::round(squareMetres * 100) / 100).text() + " m^2";
    };
    std::printf("\n");
    row("", "first view", std::to_string(end.views) + " views");
    count("Raw points", first.rawPoints, end.rawPoints);
    count("Graph vertices", first.vertices, end.vertices);
    count("Graph edges", first.edges, end.edges);
    row("Surface area", area(first.surfaceArea), area(end.surfaceArea));
    count("Rifts", first.rifts, end.rifts);
}

void printPlan(const PaperPlan& plan) {
    if (plan.dominant == PaperPlan::kNone) {
        std::printf("\nNo rift that the graph leads to: nothing is left to look at.\n");
        return;
    }
    if (plan.poses.empty()) {
        std::printf("\nThe dominant rift has no normal to look along.\n");
        return;
    }
    const Pose& view = plan.poses.back();
    const Eigen::Vector3d eye = view.translation;
    const Eigen::Vector3d ahead = view.rotation.col(2);
    std::printf(
        "\nLook next from (%.2f, %.2f, %.2f) m along (%.2f, %.2f, %.2f): the dominant rift, "
        "%.2f m of surface away.\n",
        eye.x(), eye.y(), eye.z(), ahead.x(), ahead.y(), ahead.z(), plan.overGraph.length);
}

}  // namespace

void BuildProgram::run() {
    const std::filesystem::path file = argument(0);
    requiredOut();
    RawlogReader reader(file, input_, poses_);
    std::vector<std::filesystem::path> inputs = {file};
    if (!poses_.empty()) {
        inputs.push_back(poses_);
    }
    // What is wrong with the options or the first view shows before anything is written.
    ViewBuilder builder(stereo_);
    auto observation = reader.next();
    if (!observation) {
        throw RawlogError(file.string() + ": none of its " +
                          std::to_string(reader.expectedViews()) +
                          " pairs has a pose at its time (see Input.max_pose_gap)");
    }
    Run run(*this, makeRunDirectory(inputs), std::move(builder));
    std::exception_ptr failure;
    const InterruptGuard interrupt;
    try {
        Progress bar("building", "views", reader.expectedViews(), progress());
        // The next pair is read and rectified while this one is mapped.
        const auto fetch = [&reader] { return reader.next(); };
        while (observation && !interrupt.requested()) {
            auto ahead = std::async(std::launch::async, fetch);
            run.add(*observation);
            bar.update(run.views());
            observation = ahead.get();
        }
    } catch (const std::exception&) {
        failure = std::current_exception();
    }
    if (run.views() == 0) {
        if (failure) {
            std::rethrow_exception(failure);
        }
        throw std::runtime_error("interrupted before the first view");
    }
    // Whatever happened, what was mapped so far is kept.
    const bool stopped = interrupt.requested();
    run.finish(failure ? "input_damaged" : stopped ? "interrupted" : "end_of_input");
    printTable(*firstView, *end);
    if (output_.plan) {
        printPlan(plan);
    }
    if (reader.withoutPose() > 0) {
        std::printf("%zu pairs were left out: no pose is known at their time.\n",
                    reader.withoutPose());
    }
    std::printf("\nThe map and its pictures are in %s\n", out().string().c_str());
    if (failure) {
        std::rethrow_exception(failure);
    }
    if (stopped) {
        throw std::runtime_error("interrupted after " + std::to_string(run.views()) +
                                 " views; the map so far is saved");
    }
}

}  // namespace riftmap
