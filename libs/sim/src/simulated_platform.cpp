// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/simulated_platform.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "random_bits.h"

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kTolerance = 1e-6;  // [m], [rad]: rounding of who planned the path
constexpr std::int64_t kFirstTime = 1'700'000'000'000'000'000;  // [ns]

std::string text(const Point& p) {
    char buffer[80];
    std::snprintf(buffer, sizeof(buffer), "(%.3f, %.3f, %.3f)", p.x(), p.y(), p.z());
    return buffer;
}

std::string text(double x) {
    char buffer[32];
    std::snprintf(buffer, sizeof(buffer), "%.4g", x);
    return buffer;
}

Point point(const std::vector<double>& v, const char* key) {
    if (v.size() != 3) {
        throw ConfigError(std::string("Platform.") + key + ": three numbers x y z are needed, " +
                          std::to_string(v.size()) + " given");
    }
    return {v[0], v[1], v[2]};
}

Bounds workspaceOf(const World& world, const PlatformOptions& options) {
    Bounds box = world.workspace;
    if (!options.boxMin.empty()) {
        box.min = point(options.boxMin, "box_min");
    }
    if (!options.boxMax.empty()) {
        box.max = point(options.boxMax, "box_max");
    }
    if ((box.min.array() >= box.max.array()).any()) {
        throw ConfigError("Platform.box_min " + text(box.min) + " is not below Platform.box_max " +
                          text(box.max));
    }
    const Bounds surface = bounds(world.mesh);
    const Bounds around = world.workspace;
    const Point low = surface.min.cwiseMin(around.min);
    const Point high = surface.max.cwiseMax(around.max);
    if ((box.min.array() > high.array()).any() || (box.max.array() < low.array()).any()) {
        throw ConfigError("Platform.box_min " + text(box.min) + " .. box_max " + text(box.max) +
                          " lies outside the world, which reaches from " + text(surface.min) +
                          " to " + text(surface.max));
    }
    return box;
}

StartPose startOf(const World& world, const PlatformOptions& options) {
    if (!options.start.empty()) {
        const auto& s = options.start;
        if (s.size() != 5) {
            throw ConfigError("Platform.start: five numbers x y z yaw_deg pitch_deg are needed, " +
                              std::to_string(s.size()) + " given");
        }
        return {{s[0], s[1], s[2]}, s[3] * kDegree, s[4] * kDegree};
    }
    if (static_cast<std::size_t>(options.startIndex) >= world.starts.size()) {
        throw ConfigError("Platform.start_index: " + std::to_string(options.startIndex) + ": " +
                          world.name + " has " + std::to_string(world.starts.size()) +
                          " start poses; give Platform.start");
    }
    return world.starts[static_cast<std::size_t>(options.startIndex)];
}

/// True if most directions meet the back of a surface: inside something solid. (Not all: what
/// stands on a floor shares its underside with it.) With `indoor` only where more surface follows
/// behind: else it is the building's own hull, in a file whose fronts look out of the building.
bool insideSolid(const RayCaster& caster, const Point& p, bool indoor) {
    constexpr int kMost = 16;  // of 27
    int backs = 0;
    for (int i = 0; i < 27; ++i) {
        const int x = i % 3, y = i / 3 % 3, z = i / 9;
        const Point d(x - 0.99, y - 0.98, z - 0.97);  // along no edge
        const auto hit = caster.cast(p, d);
        if (hit && hit->normal.dot(d) > 0) {
            backs += !indoor || caster.cast(p + (hit->t + 1e-3) * d, d) ? 1 : 0;
        }
    }
    return backs >= kMost;
}

}  // namespace

// ---- Options -----------------------------------------------------------------------------------

void PlatformOptions::describe(OptionTable& table) {
    table.section("Platform", "What carries the simulated camera.");
    table.addChoice("kind", kind,
                    {{"free_flying", PlatformLimits::Kind::kFreeFlying},
                     {"ground_pan_tilt", PlatformLimits::Kind::kGroundPanTilt}},
                    "Any pose in the workspace, or a ground robot whose camera pans and tilts.");
    table.add("start", start, 0, "",
              "First view: x y z yaw_deg pitch_deg (metres, degrees); empty: start_index.");
    table.add("start_index", startIndex, 0, 1000, "",
              "Which of the world's own start poses (0 .. 2).");
    table.add("box_min", boxMin, 0, "m", "Least x y z of the camera; empty: the world's own.");
    table.add("box_max", boxMax, 0, "m", "Greatest x y z of the camera; empty: the world's own.");
    table.add("clearance", clearance, 0, 100, "m",
              "Least distance from the camera to any surface.");
    table.add("max_step", maxStep, 0.001, 1e4, "m", "Longest path between two views.");
    table.add("min_height", minHeight, -1000, 1000, "m", "Least z of a ground robot's camera.");
    table.add("max_height", maxHeight, -1000, 1000, "m", "Greatest z of a ground robot's camera.");
    table.addDegrees("min_tilt_deg", minTilt, -90, 90,
                     "Lowest view of a ground robot, above the horizon.");
    table.addDegrees("max_tilt_deg", maxTilt, -90, 90,
                     "Highest view of a ground robot, above the horizon.");
    table.add("speed", speed, 0.001, 1000, "m/s", "For the timestamps of the views.");
    table.add("view_seconds", viewSeconds, 0.001, 3600, "s", "Time a view takes.");
}

void NoiseOptions::describe(OptionTable& table) {
    table.section("Noise", "How good the simulated depth is.");
    table.addChoice("level", level, {{"N0", Level::kN0}, {"N3", Level::kN3}, {"N4", Level::kN4}},
                    "N0: exact depth; N3: with disparity noise, without half-occluded pixels; "
                    "N4: image pairs, to be matched.");
    table.add("sigma_d", sigmaD, 0, 10, "px", "Standard deviation of the disparity at N3.");
}

void SimulationOptions::describe(OptionTable& table) {
    world.describe(table);
    camera.describe(table);
    platform.describe(table);
    noise.describe(table);
    render.describe(table);
}

// ---- Disparity ---------------------------------------------------------------------------------

DisparityImage exactDisparity(const Truth& truth, const CameraOptions& options,
                              const NoiseOptions& noise, std::uint64_t noiseSeed) {
    const StereoCamera camera = options.camera();
    const bool noisy = noise.level == NoiseOptions::Level::kN3;
    const auto sigma = noisy ? static_cast<float>(noise.sigmaD) : 0.0F;
    DisparityImage image;
    image.resize(camera.width, camera.height);
    image.firstColumn = std::min(options.numDisparities, camera.width);
    image.minDisparity = static_cast<float>(camera.disparity(options.farLimit));
    image.maxDisparity = static_cast<float>(options.numDisparities);
    for (int row = 0; row < camera.height; ++row) {
        for (int column = image.firstColumn; column < camera.width; ++column) {
            const float depth = truth.depth.ptr<float>(row)[column];
            if (!std::isfinite(depth) ||
                (noisy && truth.halfOccluded.ptr<unsigned char>(row)[column] != 0)) {
                continue;
            }
            const std::size_t i = image.index(column, row);
            const float d = static_cast<float>(camera.disparity(static_cast<double>(depth))) +
                            (sigma > 0 ? sigma * gaussian(noiseSeed, i) : 0.0F);
            if (d >= image.minDisparity && d <= image.maxDisparity) {
                image.disparity[i] = d;
                image.sigma[i] = std::max(sigma, kExactSigma);
            }
        }
    }
    return image;
}

std::uint64_t viewSeed(std::uint64_t seed, std::uint64_t view) {
    return mixBits(seed, view);
}

StereoObservation observe(const StereoRenderer& renderer, const CameraOptions& camera,
                          const NoiseOptions& noise, const Pose& world_T_camera,
                          std::uint64_t noiseSeed) {
    StereoObservation observation;
    observation.camera = renderer.camera();
    observation.world_T_camera = world_T_camera;
    if (noise.level == NoiseOptions::Level::kN4) {
        StereoRenderer::Pair pair = renderer.renderPair(world_T_camera, noiseSeed);
        observation.left = pair.left;
        observation.right = pair.right;
    } else {
        const bool noisy = noise.level == NoiseOptions::Level::kN3;
        observation.left = renderer.renderQuick(world_T_camera);
        observation.disparity =
            exactDisparity(renderer.truth(world_T_camera, false, noisy), camera, noise, noiseSeed);
    }
    return observation;
}

// ---- Platform ----------------------------------------------------------------------------------

namespace {

DepthKind depthKindOf(NoiseOptions::Level level) {
    switch (level) {
        case NoiseOptions::Level::kN0:
            return DepthKind::kExact;
        case NoiseOptions::Level::kN3:
            return DepthKind::kPixelwise;
        case NoiseOptions::Level::kN4:
            break;
    }
    return DepthKind::kMatched;
}

}  // namespace

struct SimulatedPlatform::Parts {
    Parts(const SimulationOptions& given, std::uint64_t givenSeed)
        : options(given),
          seed(givenSeed),
          world(makeWorld(given.world)),
          caster(world.mesh),
          renderer(world, caster, cameraFor(given), given.render),
          workspace(workspaceOf(world, given.platform)) {
        placeAtStart();
        prepareRectification();
    }

    /// Depth levels are defined for the rectified image: no lens in between.
    static CameraOptions cameraFor(const SimulationOptions& o) {
        CameraOptions camera = o.camera;
        if (o.noise.level != NoiseOptions::Level::kN4) {
            camera.distortion.clear();
        }
        return camera;
    }
    void placeAtStart();
    void prepareRectification();
    cv::Mat rectified(const cv::Mat& image) const;
    void checkKind(const Pose& pose, std::size_t index) const;
    void moveTo(const Pose& pose, std::size_t index);

    SimulationOptions options;
    std::uint64_t seed;
    World world;
    RayCaster caster;
    StereoRenderer renderer;
    Bounds workspace;
    State state;
    int collisions = 0;
    cv::Mat mapX, mapY;  ///< rectification, where the lens distorts
};

void SimulatedPlatform::Parts::placeAtStart() {
    const StartPose start = startOf(world, options.platform);
    const Point& p = start.position;
    if (!workspace.contains(p)) {
        throw ConfigError("Platform.start " + text(p) + " lies outside the workspace " +
                          text(workspace.min) + " .. " + text(workspace.max));
    }
    const bool indoor =
        !options.world.mesh.empty() && options.world.viewSpace == WorldOptions::ViewSpace::kInside;
    if (insideSolid(caster, p, indoor)) {
        throw ConfigError("Platform.start " + text(p) + " lies inside the surface of " +
                          world.name);
    }
    const auto nearest = caster.closest(p, options.platform.clearance);
    if (nearest && nearest->distance < options.platform.clearance - kTolerance) {
        throw ConfigError("Platform.start " + text(p) + " lies " + text(nearest->distance) +
                          " m from a surface of " + world.name + "; Platform.clearance asks for " +
                          text(options.platform.clearance) + " m");
    }
    state.pose = start.pose();
    state.time_ns = kFirstTime;
    try {
        checkKind(state.pose, 0);
    } catch (const std::invalid_argument& error) {
        throw ConfigError(std::string("Platform.start: ") + error.what());
    }
}

void SimulatedPlatform::Parts::prepareRectification() {
    if (!cameraFor(options).distorted()) {
        return;
    }
    const StereoCamera c = renderer.camera();
    const cv::Matx33d k(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
    std::vector<double> distortion = options.camera.distortion;
    distortion.resize(5, 0.0);
    cv::initUndistortRectifyMap(k, distortion, cv::Matx33d::eye(), k, {c.width, c.height}, CV_32FC1,
                                mapX, mapY);
}

cv::Mat SimulatedPlatform::Parts::rectified(const cv::Mat& image) const {
    if (mapX.empty()) {
        return image;
    }
    cv::Mat out;
    cv::remap(image, out, mapX, mapY, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
    return out;
}

void SimulatedPlatform::Parts::checkKind(const Pose& pose, std::size_t index) const {
    const auto fail = [&](const std::string& what) {
        throw std::invalid_argument("pose " + std::to_string(index) + " of the path: " + what);
    };
    if (!isValid(pose)) {
        fail("no rigid motion");
    }
    if (options.platform.kind != PlatformLimits::Kind::kGroundPanTilt) {
        return;
    }
    const double height = pose.translation.z();
    if (height < options.platform.minHeight - kTolerance ||
        height > options.platform.maxHeight + kTolerance) {
        fail("height " + text(height) + " m, the robot's camera reaches from " +
             text(options.platform.minHeight) + " to " + text(options.platform.maxHeight) + " m");
    }
    if (std::abs(pose.rotation(2, 0)) > kTolerance || pose.rotation(2, 1) > kTolerance) {
        fail("the camera does not keep its horizon level");
    }
    const double tilt = std::asin(std::clamp(pose.rotation(2, 2), -1.0, 1.0));
    if (tilt < options.platform.minTilt - kTolerance ||
        tilt > options.platform.maxTilt + kTolerance) {
        fail("tilt " + text(tilt / kDegree) + " deg, the robot's camera reaches from " +
             text(options.platform.minTilt / kDegree) + " to " +
             text(options.platform.maxTilt / kDegree) + " deg");
    }
}

void SimulatedPlatform::Parts::moveTo(const Pose& pose, std::size_t index) {
    const Point& from = state.pose.translation;
    const Point& to = pose.translation;
    const auto fail = [&](const std::string& what) {
        ++collisions;
        throw CollisionError("segment " + std::to_string(index) + " of the path, " + text(from) +
                             " to " + text(to) + ": " + what);
    };
    const Bounds grown{workspace.min - Point::Constant(kTolerance),
                       workspace.max + Point::Constant(kTolerance)};
    if (!grown.contains(to)) {
        fail("leaves the workspace");
    }
    const double clearance = options.platform.clearance;
    const double distance = caster.sweptDistance(from, to, clearance);
    if (distance < clearance - kTolerance) {
        fail("comes within " + text(distance) + " m of a surface, the clearance is " +
             text(clearance) + " m");
    }
    const double length = (to - from).norm();
    state.pathLength += length;
    state.time_ns += std::llround(length / options.platform.speed * 1e9);
    state.pose = pose;
}

SimulatedPlatform::SimulatedPlatform(const SimulationOptions& options, std::uint64_t seed)
    : parts_(std::make_unique<Parts>(options, seed)) {}
SimulatedPlatform::~SimulatedPlatform() = default;

StereoCamera SimulatedPlatform::camera() const {
    return parts_->renderer.camera();
}
Pose SimulatedPlatform::pose() const {
    return parts_->state.pose;
}
SimulatedPlatform::State SimulatedPlatform::state() const {
    return parts_->state;
}
int SimulatedPlatform::collisions() const {
    return parts_->collisions;
}
double SimulatedPlatform::pathLength() const {
    return parts_->state.pathLength;
}
const World& SimulatedPlatform::world() const {
    return parts_->world;
}
const RayCaster& SimulatedPlatform::rayCaster() const {
    return parts_->caster;
}
const StereoRenderer& SimulatedPlatform::renderer() const {
    return parts_->renderer;
}

PlatformLimits SimulatedPlatform::limits() const {
    const PlatformOptions& o = parts_->options.platform;
    PlatformLimits limits;
    limits.kind = o.kind;
    limits.boxMin = parts_->workspace.min;
    limits.boxMax = parts_->workspace.max;
    limits.clearance = o.clearance;
    limits.maxStep = o.maxStep;
    if (o.kind == PlatformLimits::Kind::kGroundPanTilt) {
        limits.minHeight = o.minHeight;
        limits.maxHeight = o.maxHeight;
        limits.minTilt = o.minTilt;
        limits.maxTilt = o.maxTilt;
    }
    limits.nearLimit = parts_->options.camera.nearLimit();
    limits.farLimit = parts_->options.camera.farLimit;
    limits.depthKind = depthKindOf(parts_->options.noise.level);
    return limits;
}

void SimulatedPlatform::moveAlong(const std::vector<Pose>& path) {
    double length = 0;
    Point at = parts_->state.pose.translation;
    for (std::size_t i = 0; i < path.size(); ++i) {
        parts_->checkKind(path[i], i);
        length += (path[i].translation - at).norm();
        at = path[i].translation;
    }
    if (length > parts_->options.platform.maxStep + kTolerance) {
        throw std::invalid_argument("path of " + text(length) + " m: Platform.max_step allows " +
                                    text(parts_->options.platform.maxStep) +
                                    " m between two views");
    }
    for (std::size_t i = 0; i < path.size(); ++i) {
        parts_->moveTo(path[i], i);
    }
}

void SimulatedPlatform::setState(const State& state) {
    parts_->checkKind(state.pose, 0);
    parts_->state = state;
}

StereoObservation SimulatedPlatform::grab() {
    const State& state = parts_->state;
    StereoObservation observation =
        observe(parts_->renderer, parts_->options.camera, parts_->options.noise, state.pose,
                viewSeed(parts_->seed, state.views));
    observation.time_ns = state.time_ns;
    observation.left = parts_->rectified(observation.left);
    observation.right = parts_->rectified(observation.right);
    skipView();
    return observation;
}

void SimulatedPlatform::skipView() {
    State& state = parts_->state;
    ++state.views;
    state.time_ns += std::llround(parts_->options.platform.viewSeconds * 1e9);
}

std::unique_ptr<SimulatedPlatform> makePlatform(const SimulationOptions& options,
                                                std::uint64_t seed) {
    return std::make_unique<SimulatedPlatform>(options, seed);
}

}  // namespace riftmap
