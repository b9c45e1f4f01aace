// SPDX-License-Identifier: BSD-3-Clause
// Public data sets -> rawlog. All throw FileError that names the file that is missing or
// wrong, and where in it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "riftmap/apps/rawlog_writer.h"
#include "riftmap/core/camera.h"
#include "riftmap/core/options.h"
#include "riftmap/core/progress.h"

namespace riftmap {

/// What an import brought over.
struct ImportReport {
    std::size_t pairs = 0;
    std::size_t poses = 0;
    std::size_t absent = 0;  ///< pairs the recording lists but whose images are not there
    StereoCamera camera;     ///< the rectified camera; of a raw recording only size and baseline
    bool rectified = true;
};

/// Section [Kitti].
struct KittiOptions {
    double rate = 10.0;  ///< pairs a second where the recording has no times.txt [Hz]
    void describe(OptionTable& table);
};

/// A sequence of KITTI odometry: image_0/ and image_1/ (or image_2/ and image_3/), calib.txt or
/// calib_orig.txt (rows P0 P1 .. with or without their names), poses.txt, and times.txt if there.
/// The robot is where the left camera is, x forward, z up; the map frame is its first pose.
ImportReport importKitti(const std::filesystem::path& folder, const KittiOptions& options,
                         RawlogWriter& writer, const OnProgress& progress);

/// A recording of EuRoC's: mav0/ or the folder that holds it. Pairs stay raw, with the calibration
/// of both cameras and their poses on the body; ground truth of the body from
/// state_groundtruth_estimate0/data.csv, or from the one .csv file beside mav0/, where there.
ImportReport importEuroc(const std::filesystem::path& folder, RawlogWriter& writer,
                         const OnProgress& progress);

/// Section [Pair]: the calibration of a rectified pair.
struct PairOptions {
    double f = 0;         ///< focal length [px]
    double cx = 0;        ///< principal point of the left camera [px]
    double cy = 0;        ///< [px]
    double doffs = 0;     ///< right principal point minus left one [px]
    double baseline = 0;  ///< [m]
    void describe(OptionTable& table);
};

/// A calib.txt of Middlebury 2014 (cam0=[f 0 cx; 0 f cy; 0 0 1], doffs, baseline in mm).
PairOptions readMiddleburyCalibration(const std::filesystem::path& file);

/// One rectified pair; the camera looks ahead from the origin of the map frame.
ImportReport importPair(const std::filesystem::path& left, const std::filesystem::path& right,
                        const PairOptions& options, RawlogWriter& writer);

}  // namespace riftmap
