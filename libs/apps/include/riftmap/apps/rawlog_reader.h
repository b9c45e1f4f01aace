// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/img/TStereoCamera.h>
#include <mrpt/obs/CObservationStereoImages.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "riftmap/apps/pose_track.h"
#include "riftmap/apps/rawlog_objects.h"
#include "riftmap/core/options.h"
#include "riftmap/core/view.h"

namespace riftmap {

/// Section [Input]: what is taken from a rawlog or simplemap.
struct RawlogOptions {
    /// Whose pose a CObservationRobotPose with a sensor pose of its own holds. MRPT's
    /// documentation and its code disagree, so such a file is refused until this is said.
    enum class PoseOf { kRefuse, kRobot, kSensor };
    enum class FileOf { kCamera, kRobot };

    std::string sensor;                ///< label of the stereo camera; empty: there is only one
    int firstView = 0;                 ///< index of the first pair taken
    int everyView = 1;                 ///< then every so many
    int maxViews = 0;                  ///< at most so many; 0 = all
    double maxPoseGap = 1.0;           ///< longest time to interpolate over [s]
    FileOf posesOf = FileOf::kCamera;  ///< what the poses of --poses are of
    PoseOf robotPoseOf = PoseOf::kRefuse;
    /// Pose of the left optical frame on the robot, in place of the recorded one; empty = recorded.
    std::vector<double> cameraXyz;      ///< [m], 0 or 3 numbers
    std::vector<double> cameraYpr_deg;  ///< yaw, pitch, roll [deg], 0 or 3 numbers

    void describe(OptionTable& table);
};

/// What is in a rawlog, from one pass over it that looks at no pixel.
struct RawlogContents {
    struct Sensor {
        std::size_t pairs = 0;
        std::int64_t first_ns = 0, last_ns = 0;
        mrpt::img::TStereoCamera calibration;  ///< of the first pair
        bool rectified = false, external = false;
    };
    std::size_t objects = 0;                     ///< sound ones
    std::map<std::string, std::size_t> classes;  ///< how many objects of which class
    std::map<std::string, Sensor> sensors;       ///< stereo cameras by label
    PoseTrack poses;                             ///< of the robot, recorded or from actions
    std::size_t actions = 0;                     ///< poses are dead reckoning where > 0
    std::string damage;  ///< where and why reading ended early; empty if the file is sound
};

/// Throws RawlogError only where nothing at all can be read; damage further on is told in the
/// result.
RawlogContents scanRawlog(const std::filesystem::path& file, const RawlogOptions& options);

/// Stereo pairs with their poses out of a rawlog (observations, or actions and sensory frames,
/// images inside or beside it) or a .simplemap. Reads in a stream: memory does not grow with the
/// file. Images come out rectified. Not thread-safe.
class RawlogReader {
 public:
    /// @param posesFile poses in TUM's format in place of those inside; empty = those inside
    /// Throws RawlogError: nothing readable, no stereo pairs, no poses; ConfigError: options that
    /// do not fit the file.
    RawlogReader(const std::filesystem::path& file, const RawlogOptions& options,
                 const std::filesystem::path& posesFile = {});
    ~RawlogReader();
    RawlogReader(RawlogReader&&) noexcept;
    RawlogReader& operator=(RawlogReader&&) noexcept;

    /// The next pair; nothing at the end. Throws RawlogError where the file is damaged or an
    /// observation makes no sense (calibration or pose not finite, images of different sizes, time
    /// that runs backwards); all pairs before that place were returned.
    std::optional<StereoObservation> next();

    std::size_t expectedViews() const;  ///< how many pairs the options select
    std::size_t withoutPose() const;    ///< pairs left out since no pose is known at their time
    const RawlogContents& contents() const;

 private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace riftmap
