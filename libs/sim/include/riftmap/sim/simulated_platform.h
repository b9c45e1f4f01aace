// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "riftmap/core/options.h"
#include "riftmap/core/platform.h"
#include "riftmap/sim/ray_caster.h"
#include "riftmap/sim/stereo_renderer.h"
#include "riftmap/sim/world.h"

namespace riftmap {

/// Section [Platform]: what carries the simulated camera.
struct PlatformOptions {
    PlatformLimits::Kind kind = PlatformLimits::Kind::kFreeFlying;
    /// x y z yaw_deg pitch_deg of the first view; empty: the world's start number startIndex.
    std::vector<double> start;
    int startIndex = 0;
    std::vector<double> boxMin, boxMax;    ///< workspace x y z [m]; empty: the world's
    double clearance = 0.2;                ///< [m]
    double maxStep = 10;                   ///< longest path between two views [m]
    double minHeight = 0.4;                ///< of the camera, ground kind [m]
    double maxHeight = 1.8;                ///< [m]
    double minTilt = -1.0471975511965976;  ///< ground kind [rad]
    double maxTilt = 1.0471975511965976;   ///< [rad]
    double speed = 1.0;                    ///< [m/s]: for the views' timestamps
    double viewSeconds = 1.0;              ///< time a view takes [s]
    void describe(OptionTable& table);
};

/// Section [Noise]: how good the depth is (doc/coverage_protocol.md).
struct NoiseOptions {
    enum class Level {
        kN0,  ///< exact depth of every pixel in range, as an ideal depth camera sees it
        kN3,  ///< depth with Gaussian disparity noise; half-occluded pixels have none
        kN4,  ///< image pairs for a real matcher
    };
    Level level = Level::kN4;
    double sigmaD = 0.25;  ///< standard deviation of the disparity at N3 [px]
    void describe(OptionTable& table);
};

/// Standard deviation that N0 states for its exact disparities [px]: 0.7 mm at 6 m.
inline constexpr float kExactSigma = 1e-3F;

/// Everything the simulation can be told.
struct SimulationOptions {
    WorldOptions world;
    CameraOptions camera;
    PlatformOptions platform;
    NoiseOptions noise;
    RenderOptions render;
    /// Sections [World] [Camera] [Platform] [Noise] [Render].
    void describe(OptionTable& table);
};

/// Disparity of every left pixel from exact depth. The measured range is that of a matcher which
/// searches 0 .. num_disparities: pixels left of column num_disparities have none, nor have
/// surfaces nearer than the near limit or farther than the far one. N0 keeps half-occluded pixels,
/// as a depth camera would; N3 drops them and adds noise. `level` is not kN4.
DisparityImage exactDisparity(const Truth& truth, const CameraOptions& camera,
                              const NoiseOptions& noise, std::uint64_t noiseSeed);

/// Seed of the noise in view number `view`.
std::uint64_t viewSeed(std::uint64_t seed, std::uint64_t view);

/// What the rig sees from a pose. N0, N3: `left` is a quick picture, `right` is empty, `disparity`
/// is set. N4: a pair, still distorted if the lens is. The time is 0.
StereoObservation observe(const StereoRenderer& renderer, const CameraOptions& camera,
                          const NoiseOptions& noise, const Pose& world_T_camera,
                          std::uint64_t noiseSeed);

/// A stereo camera that moves in a world. Owns world, caster and renderer. Not thread-safe.
class SimulatedPlatform : public CameraPlatform {
 public:
    /// Throws MeshError for a world that cannot be used, ConfigError for a start inside or too
    /// near a surface or outside the workspace, or a workspace that does not meet the world.
    SimulatedPlatform(const SimulationOptions& options, std::uint64_t seed);
    ~SimulatedPlatform() override;
    SimulatedPlatform(const SimulatedPlatform&) = delete;
    SimulatedPlatform& operator=(const SimulatedPlatform&) = delete;

    StereoCamera camera() const override;
    PlatformLimits limits() const override;
    Pose pose() const override;
    /// Straight from the present pose to the first, and on. Each pose reached becomes the present
    /// one. Throws CollisionError (counted) as the base class says; std::invalid_argument, before
    /// anything moves, for a path longer than the largest step or a pose this kind cannot take.
    void moveAlong(const std::vector<Pose>& path) override;
    /// As observe() tells; N4's pairs are rectified. The noise depends on the seed and the number
    /// of views before.
    StereoObservation grab() override;
    /// Time and noise go on as if grab() had been called: what it would return is known.
    void skipView();

    /// What decides the next observation: to go on from an earlier run.
    struct State {
        Pose pose;
        std::int64_t time_ns = 0;
        std::uint64_t views = 0;  ///< taken so far
        double pathLength = 0;    ///< [m]
    };
    State state() const;
    /// Puts the platform where an earlier one was. Throws std::invalid_argument for a bad pose.
    void setState(const State& state);

    int collisions() const;     ///< moves that touched a surface or left the workspace
    double pathLength() const;  ///< [m]
    const World& world() const;
    const RayCaster& rayCaster() const;
    const StereoRenderer& renderer() const;

 private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

/// The platform of riftmap-explore. Throws as the constructor does.
std::unique_ptr<SimulatedPlatform> makePlatform(const SimulationOptions& options,
                                                std::uint64_t seed);

}  // namespace riftmap
