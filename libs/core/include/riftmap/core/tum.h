// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "riftmap/core/pose.h"

namespace riftmap {

/// A pose at a time.
struct TimedPose {
    std::int64_t time_ns = 0;  ///< since the Unix epoch [ns]
    Pose pose;                 ///< e.g. of the left camera's optical frame in the map frame
};

/// Reads a trajectory `t x y z qx qy qz qw` (seconds, metres), a pose a line; `#` starts a comment.
/// Times keep their nanoseconds exactly, however they are written. Quaternions are normalised.
/// Throws FileError (file, line, what): not 8 numbers, not finite, |q| off 1 by more than 1e-2, a
/// time not after the one before.
std::vector<TimedPose> readTum(const std::filesystem::path& file);

/// Writes a trajectory that reads back to the same times and, within rounding, poses. Atomic.
/// Throws FileError, or std::invalid_argument for an invalid pose or times that do not ascend.
void writeTum(const std::filesystem::path& file, const std::vector<TimedPose>& trajectory);

/// One line of such a file, without the line end.
std::string tumLine(const TimedPose& pose);

/// Seconds as decimal text ("12.000000001", "1.4e9") to nanoseconds, exactly; digits beyond are
/// rounded. Throws std::invalid_argument.
std::int64_t nanosecondsFromText(const std::string& seconds);
/// The inverse, with nine decimals.
std::string textFromNanoseconds(std::int64_t time_ns);

}  // namespace riftmap
