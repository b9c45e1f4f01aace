// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

namespace riftmap {

/// A grey image of floats. As a disparity image in Middlebury's convention: [px], infinity where
/// nothing is known.
struct FloatImage {
    int width = 0;              ///< [px]
    int height = 0;             ///< [px]
    std::vector<float> values;  ///< row-major from the top; width * height
};

/// Reads a grey PFM file ("Pf") of either byte order. Throws FileError: file, byte offset, what.
FloatImage readPfm(const std::filesystem::path& file);

/// Writes a little-endian grey PFM file, rows from the bottom as the format asks. Atomic. Throws
/// FileError, or std::invalid_argument if the sizes do not fit together.
void writePfm(const std::filesystem::path& file, const FloatImage& image);

}  // namespace riftmap
