// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace riftmap {

/// What a map of a recording costs, in resident memory of the process.
struct RecordedMemory {
    std::size_t views = 0, vertices = 0;
    double mapBytes = 0;              ///< vertices, edges, hash, rifts
    double bufferBytes = 0;           ///< that merging keeps from view to view
    double countedBytes = 0;          ///< PixelGraph::memoryBytes()
    double mergeMs = 0, riftsMs = 0;  ///< medians
};

/// Imports `kitti` or `euroc` from the folder and merges all of it with that configuration.
/// `blockSize` > 0 replaces the configuration's [m].
RecordedMemory recordedMemory(const std::string& kind, const std::filesystem::path& folder,
                              const std::filesystem::path& config, double blockSize);

/// Resident memory of this process after what is free was given back [bytes].
double residentBytes();

}  // namespace riftmap
