// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CObservationStereoImages.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "riftmap/core/view.h"

namespace riftmap {

/// Pose of a camera that looks ahead, on a robot (x forward, y left, z up).
Pose forwardCamera();

/// Writes a rawlog of observations in MRPT's own classes, so that every program of MRPT reads it.
/// The file appears under its name when finish() is done, until then it is FILE.part. Not
/// thread-safe.
class RawlogWriter {
 public:
    enum class Images {
        kEmbedded,  ///< inside the rawlog, lossless
        kExternal,  ///< PNG files in NAME_Images beside NAME.rawlog
    };

    enum class Mode {
        kNew,
        kAppend,  ///< goes on behind what is in FILE
    };

    /// Throws FileError where the file cannot be made (or read, to append).
    explicit RawlogWriter(const std::filesystem::path& file, Images images = Images::kEmbedded,
                          Mode mode = Mode::kNew);
    /// Without finish(): nothing is left behind but images and, if there are any, the views of
    /// view() and write() in FILE.part.
    ~RawlogWriter();
    RawlogWriter(const RawlogWriter&) = delete;
    RawlogWriter& operator=(const RawlogWriter&) = delete;

    /// A note at a time (MRPT's own tools give the time range of a file by all its objects).
    void comment(std::int64_t time_ns, const std::string& text);
    /// A pose of the robot in the map frame, label "pose".
    void robotPose(std::int64_t time_ns, const Pose& world_T_robot);
    /// A pair as it is; its images may be moved out to files.
    void pair(mrpt::obs::CObservationStereoImages& observation);

    /// Both, and to the disk with them, as write() says.
    void view(const mrpt::obs::CObservationRobotPose& pose,
              mrpt::obs::CObservationStereoImages& pair);

    /// Robot pose and rectified pair, the camera looking ahead on the robot. Returns the camera's
    /// pose as a reader will see it: angles and quaternions in the file cost the last bits, and
    /// a map to be built again to the byte must be built from this one. The view is on its way to
    /// the disk then: who is killed keeps it, see salvageRawlog().
    Pose write(const StereoObservation& observation, const std::string& label = "stereo");

    /// Closes the file, reads its end back (MRPT does not notice a full disk) and gives it its
    /// name. Throws FileError.
    void finish();

 private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

/// Makes FILE of what a recording that was killed has left behind (FILE.part, or FILE itself): the
/// views that are whole, as RawlogWriter::write() put them there. Returns how many; where there are
/// none, or no file at all, there is no FILE afterwards. Throws FileError where it cannot be
/// written, and, changing nothing, where there is no view although `someExpected`.
std::size_t salvageRawlog(const std::filesystem::path& file, bool someExpected = false);

/// A rectified pair as an MRPT observation: calibration, images (copied), time, label and the pose
/// of the camera on the robot.
mrpt::obs::CObservationStereoImages::Ptr toMrpt(const StereoObservation& observation,
                                                const Pose& robot_T_camera,
                                                const std::string& label);

}  // namespace riftmap
