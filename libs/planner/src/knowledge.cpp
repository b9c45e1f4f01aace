// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "riftmap/planner/view_planner.h"

namespace riftmap {

namespace {

std::optional<Eigen::AlignedBox3d> toBox(const std::vector<double>& v) {
    if (v.empty()) {
        return std::nullopt;
    }
    if (v.size() != 6 || !(v[0] < v[3] && v[1] < v[4] && v[2] < v[5])) {
        throw ConfigError(
            "Planner.surface_box: must be empty or six numbers, the smallest corner first");
    }
    return Eigen::AlignedBox3d(Eigen::Vector3d(v[0], v[1], v[2]),
                               Eigen::Vector3d(v[3], v[4], v[5]));
}

/// Part s of the turn from one optical axis to another, about the vertical and up or down: the
/// horizon stays level and the tilt between those of the two.
Eigen::Vector3d axisBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double s) {
    const auto azimuth = [](const Eigen::Vector3d& d, const Eigen::Vector3d& other) {
        const Eigen::Vector3d& known = std::hypot(d.x(), d.y()) > 1e-6 ? d : other;
        return std::atan2(known.y(), known.x());
    };
    const auto tilt = [](const Eigen::Vector3d& d) {
        return std::atan2(d.z(), std::hypot(d.x(), d.y()));
    };
    const double turn = std::remainder(azimuth(b, a) - azimuth(a, b), 2 * 3.14159265358979323846);
    const double around = azimuth(a, b) + s * turn;
    const double up = tilt(a) + s * (tilt(b) - tilt(a));
    return {std::cos(up) * std::cos(around), std::cos(up) * std::sin(around), std::sin(up)};
}

constexpr int kBeside = 2;  // [voxels] that the camera may go beyond those that are clear

double cellSizeOf(const PlannerOptions& options, const PixelGraph& graph) {
    return options.cellSize > 0 ? options.cellSize : 4 * graph.options().targetResolution;
}

Eigen::AlignedBox3d cameraBoxOf(const PlatformLimits& limits) {
    Eigen::AlignedBox3d box(limits.boxMin, limits.boxMax);
    if (limits.kind == PlatformLimits::Kind::kGroundPanTilt) {
        box.min().z() = std::max(box.min().z(), limits.minHeight);
        box.max().z() = std::min(box.max().z(), limits.maxHeight);
    }
    return box;
}

/// The camera's box with a margin in which surfaces are looked for.
Eigen::AlignedBox3d gridBox(const PlatformLimits& limits,
                            const std::optional<Eigen::AlignedBox3d>& surfaces) {
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(limits.clearance + 0.1);
    Eigen::AlignedBox3d box(limits.boxMin - margin, limits.boxMax + margin);
    if (surfaces) {
        box.extend(*surfaces);
    }
    return box;
}

double voxelSizeOf(const PlannerOptions& options, const Eigen::AlignedBox3d& box,
                   double clearance) {
    if (options.voxelSize > 0) {
        return options.voxelSize;
    }
    constexpr double kVoxels = 4e5;
    return std::max(std::cbrt(box.volume() / kVoxels), std::max(0.03, 0.35 * clearance));
}

/// Fine enough that what is left of the box shows the object's shape.
FreeSpace hullOf(const Eigen::AlignedBox3d& surfaces, double cell) {
    constexpr double kVoxels = 1e5;
    const double voxel = std::max(std::cbrt(surfaces.volume() / kVoxels), 1.25 * cell);
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(1.5 * voxel);
    FreeSpace hull(Eigen::AlignedBox3d(surfaces.min() - margin, surfaces.max() + margin), voxel);
    hull.declareFreeOutside(surfaces);
    return hull;
}

/// Whether a view has matches where it sees this place: one pixel in ten around it. Nothing if the
/// place is not in the image.
std::optional<bool> matchesAt(const View& view, const Eigen::Vector3d& place) {
    constexpr int kReach = 6;  // [px]
    const Eigen::Vector3d p = view.world_T_camera.inverse() * place;
    if (!(p.z() > 0.01)) {
        return std::nullopt;
    }
    const DisparityImage& d = view.disparity;
    const Eigen::Vector2d uv = view.camera.project(p);
    if (uv.x() < d.firstColumn || uv.y() < 0 || uv.x() > d.width - 1 || uv.y() > d.height - 1) {
        return std::nullopt;
    }
    const auto column = static_cast<int>(std::lround(uv.x()));
    const auto row = static_cast<int>(std::lround(uv.y()));
    int all = 0;
    int matched = 0;
    for (int r = std::max(0, row - kReach); r <= std::min(row + kReach, d.height - 1); ++r) {
        for (int c = std::max(0, column - kReach); c <= std::min(column + kReach, d.width - 1);
             ++c) {
            ++all;
            matched += d.valid(c, r) ? 1 : 0;
        }
    }
    return 10 * matched >= all;
}

}  // namespace

void PlannerOptions::describe(OptionTable& table) {
    table.section("Planner", "Choice of the next view");
    table.add("cell_size", cellSize, 0, 10, "m",
              "Edge of the cells that the map is summed up in for planning; 0 = 4 target "
              "resolutions");
    table.add("voxel_size", voxelSize, 0, 10, "m",
              "Edge of the voxels of the known free space; 0 = by the size of the workspace");
    table.add("view_cost", viewCost, 0.01, 100, "m", "Cost of taking a view, as length of path");
    table.add(
        "min_gain", minGain, 0, 1, "",
        "A view that promises less than this share of the surface known is not worth taking; "
        "0 = 0.0004, with exact depth 0.0001, with noisy depth that is not matched 0.0007; "
        "around an object (surface_box) 0.0003, 0.0004 and 0.00048; with 0 of no more surface "
        "than fills ten images at the far limit (400 m^2 at 6 m)");
    table.add("max_attempts", maxAttempts, 1, 100, "",
              "Different views of a tear that may fail before it is given up");
    table.add("unknown_weight", unknownWeight, 0, 100, "",
              "Weight of unknown space looked into against tears to be closed");
    table.add(
        "new_surface_depth", newSurfaceDepth, 0, 100, "",
        "Up to how many times the depth at which one view is as accurate as asked new surface "
        "counts in full; 0 = by the share that noise leaves within the target resolution");
    table.add("clearance_margin", clearanceMargin, 0, 10, "m",
              "Kept to surfaces beyond the platform's clearance");
    table.add("targets", targets, 1, 10000, "", "Tears that candidate views are made for, a plan");
    table.add("candidates", candidates, 1, 100000, "", "Views of tears that are scored, a plan");
    table.add("places", places, 0, 10000, "", "Places of candidate views that aim at no tear");
    table.add("surface_box", surfaceBox, 0, "m",
              "Surfaces lie in this box (xmin ymin zmin xmax ymax zmax) and the space around it is "
              "free; empty = nothing is known beforehand");
    table.add(
        "background_is_free", backgroundIsFree,
        "Pixels without a match show that there is no surface within the range, as far as both "
        "cameras see and but for those beside surface too near to be matched");
}

Knowledge::Knowledge(const PixelGraph& graph, const PlatformLimits& limits,
                     const PlannerOptions& options)
    : graph_(&graph),
      limits_(limits),
      options_(options),
      surfaceBox_(toBox(options.surfaceBox)),
      cameraBox_(cameraBoxOf(limits)),
      summary_(cellSizeOf(options, graph), graph.options().targetResolution),
      space_(gridBox(limits, surfaceBox_),
             voxelSizeOf(options, gridBox(limits, surfaceBox_), limits.clearance)),
      ledger_(graph.options().targetResolution, options.maxAttempts) {
    if (surfaceBox_) {
        space_.declareFreeOutside(*surfaceBox_);
        hull_ = hullOf(*surfaceBox_, summary_.cellSize());
    }
}

void Knowledge::update(const View& view) {
    ++views_;
    camera_ = view.world_T_camera;
    sensor_ = SensorModel::of(view, limits_);
    const EmptyPixels empty = space_.emptyPixels(view, sensor_, options_.backgroundIsFree);
    seenThrough_.add(view, empty);
    summary_.update(*graph_, view, &seenThrough_);
    ledger_.update(summary_);
    // Surface that is seen in there counts all the same.
    space_.declareFree(camera_.translation, freeAround());
    space_.carve(view, sensor_, empty);
    updateSurface(space_);
    for (std::size_t i = 0; i < summary_.changed().size(); ++i) {
        const auto it = summary_.blocks().find(summary_.changed()[i]);
        const SurfaceSummary::Block& former = summary_.former()[i];
        if (it != summary_.blocks().end() || !former.cells.empty()) {
            space_.forget(it != summary_.blocks().end() ? it->second.box : former.box);
        }
    }
    if (hull_) {
        hull_->carve(view, sensor_, empty);
        updateSurface(*hull_);
    }
}

void Knowledge::noteLooks(const View& view, const std::vector<Eigen::Vector3d>& places) {
    for (const Eigen::Vector3d& place : places) {
        unseen().noteTry(place);
        if (const auto matched = matchesAt(view, place)) {
            unseen().noteLook(place, *matched);
        }
    }
}

/// Where the surface is, as far as the last view changed it.
void Knowledge::updateSurface(FreeSpace& space) const {
    const auto forEachPiece = [](const SurfaceSummary::Block& block, const auto& f) {
        for (const SurfaceCell& cell : block.cells) {
            if (cell.vertices >= SurfaceSummary::kLeastVertices) {
                f(cell.position.cast<double>());
            }
        }
    };
    for (std::size_t i = 0; i < summary_.changed().size(); ++i) {
        forEachPiece(summary_.former()[i],
                     [&](const Eigen::Vector3d& p) { space.removeSurface(p); });
        const auto it = summary_.blocks().find(summary_.changed()[i]);
        if (it != summary_.blocks().end()) {
            forEachPiece(it->second, [&](const Eigen::Vector3d& p) { space.addSurface(p); });
        }
    }
}

void Knowledge::updateReach() {
    space_.updateClear(clearance(), cameraBox_);
    anchor_ = camera_.translation;
    if (!space_.isClear(anchor_)) {
        // Between voxels, where placeAt() let it go, or in a passage: ways begin at a centre.
        const Eigen::Vector3d own = space_.snap(anchor_);
        const auto beside = space_.nearestClear(anchor_, kBeside, false);
        if (passages_ && fits(anchor_, own)) {
            anchor_ = own;
        } else if (beside && fits(anchor_, *beside)) {
            anchor_ = *beside;
        }
    }
    const FreeSpace::Fits fits = [this](const auto& p) { return fitsBetweenVoxels(p); };
    reached_ = space_.updateReach(anchor_, passages_ ? fits : FreeSpace::Fits());
}

bool Knowledge::openPassages(bool atTheEnd) {
    constexpr std::size_t kEvery = 20;  // [views] as a rule there are none, and a look takes time
    constexpr double kLeadOn = 1.002;   // less is a corner that voxels miss, and ways take longer
    const double enough = kLeadOn * static_cast<double>(reached_);
    if (passages_ || (views_ < nextLook_ && !atTheEnd) ||
        static_cast<double>(space_.clearCount()) <= enough) {  // nowhere to lead to
        return false;
    }
    nextLook_ = views_ + kEvery;
    passages_ = true;
    space_.forgetAll();
    updateReach();
    passages_ = static_cast<double>(reached_) > enough;
    if (passages_) {
        ledger_.reopen(RiftState::kUnreachable);
        ledger_.reopen(RiftState::kDeferred);
    } else {
        updateReach();
        space_.forgetAll();
    }
    return passages_;
}

/// True if the camera keeps its clearance here, and on the straight ways to the centres of the
/// voxels around.
bool Knowledge::fitsBetweenVoxels(const Eigen::Vector3d& centre) const {
    const double half = std::sqrt(0.75) * space_.voxelSize();
    const double radius = std::hypot(clearance(), half);
    return space_.knownAround(centre, radius, true) &&
           !graph_->anyWithin(centre.cast<float>(), static_cast<float>(radius));
}

/// True if the camera keeps its clearance on the straight way, by the surface itself.
bool Knowledge::fits(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    constexpr double kStep = 0.03;  // [m] the way dips below the clearance by less than 1 mm
    const int n = std::max(1, static_cast<int>(std::ceil((to - from).norm() / kStep)));
    const auto radius = static_cast<float>(clearance());
    for (int i = 0; i <= n; ++i) {
        const Eigen::Vector3d p = from + (to - from) * (static_cast<double>(i) / n);
        if (!cameraBox_.contains(p) || !space_.knownAround(p, clearance(), false) ||
            graph_->anyWithin(p.cast<float>(), radius)) {
            return false;
        }
    }
    return true;
}

std::optional<Knowledge::Place> Knowledge::placeAt(const Eigen::Vector3d& eye) const {
    const double detour = (anchor_ - camera_.translation).norm();
    if (space_.snap(eye) == space_.snap(camera_.translation)) {
        return Place{camera_.translation, 0.0};
    }
    const double path = space_.distanceTo(eye);
    if (std::isfinite(path)) {
        return Place{space_.snap(eye), detour + path};
    }
    const auto beside = space_.nearestClear(eye, kBeside, true);
    if (!beside || !fits(*beside, eye)) {
        return std::nullopt;
    }
    return Place{eye, detour + space_.distanceTo(*beside) + (eye - *beside).norm()};
}

double Knowledge::minGain() const {
    // What exact depth promises is there if it can be seen at all. Around an object, views of folds
    // that only one camera looks into bring nothing, and matching gets better bit by bit.
    struct Shares {
        double inRooms, aroundObject;
    };
    constexpr Shares kExact{1e-4, 4e-4}, kPixelwise{7e-4, 4.8e-4}, kMatched{4e-4, 3e-4};
    const Shares& shares = sensor_.exactDepth() ? kExact
                           : sensor_.matched()  ? kMatched
                                                : kPixelwise;
    if (options_.minGain > 0) {
        return options_.minGain * summary_.area();
    }
    // A share of all would leave ever larger holes in ever larger buildings.
    const double most = 10 * sensor_.areaSeenAt(sensor_.farLimit);
    return (surfaceBox() ? shares.aroundObject : shares.inRooms) * std::min(summary_.area(), most);
}

bool Knowledge::mayBeAt(const Eigen::Vector3d& place) const {
    return cameraBox_.contains(place) && space_.at(place) == FreeSpace::State::kFree &&
           !graph_->anyWithin(place.cast<float>(), static_cast<float>(limits_.clearance));
}

bool Knowledge::tiltAllowed(const Pose& pose) const {
    const double tilt = std::asin(std::clamp(pose.rotation(2, 2), -1.0, 1.0));
    return tilt >= limits_.minTilt - 1e-9 && tilt <= limits_.maxTilt + 1e-9;
}

std::vector<Pose> Knowledge::pathTo(const Pose& goal) const {
    const bool clear = std::isfinite(space_.distanceTo(goal.translation));
    const auto beside = clear ? std::optional(goal.translation)
                              : space_.nearestClear(goal.translation, kBeside, true);
    if (!beside) {
        return {};
    }
    std::vector<Eigen::Vector3d> corners = space_.pathTo(*beside);
    if (anchor_ != camera_.translation) {
        corners.insert(corners.begin(), camera_.translation);
    }
    if (!clear) {
        corners.push_back(goal.translation);
    }
    double length = 0;
    for (std::size_t i = 1; i < corners.size(); ++i) {
        length += (corners[i] - corners[i - 1]).norm();
    }
    std::vector<Pose> path;
    double walked = 0;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        walked += (corners[i] - corners[i - 1]).norm();
        const Eigen::Vector3d axis = axisBetween(camera_.rotation.col(2), goal.rotation.col(2),
                                                 length > 0 ? walked / length : 1.0);
        path.push_back(lookAt(corners[i], corners[i] + axis));
    }
    path.push_back(goal);
    return path;
}

}  // namespace riftmap
