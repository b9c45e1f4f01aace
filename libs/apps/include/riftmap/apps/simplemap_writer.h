// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "riftmap/core/view.h"

namespace riftmap {

/// Writes a .simplemap (what observations2map and other programs of MRPT make maps from): each
/// view a keyframe with its rectified pair inside, the camera looking ahead on the robot. Streams:
/// memory does not grow with the number of views. Not thread-safe.
class SimpleMapWriter {
 public:
    /// Throws FileError.
    explicit SimpleMapWriter(const std::filesystem::path& file);
    ~SimpleMapWriter();  ///< without finish(): nothing is left behind
    SimpleMapWriter(const SimpleMapWriter&) = delete;
    SimpleMapWriter& operator=(const SimpleMapWriter&) = delete;

    void add(const StereoObservation& observation);

    /// Completes the file and gives it its name. Throws FileError.
    void finish();

 private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace riftmap
