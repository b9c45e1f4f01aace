// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace riftmap {

/// Reads the sides that samples are seen on (+1, -1, 0 not at all). False if the directory holds
/// no whole, undamaged set of this key and size: it is computed again then.
bool readObservable(const std::filesystem::path& directory, std::uint64_t key, std::size_t count,
                    std::vector<std::int8_t>& sides);

/// Atomic. Throws FileError.
void writeObservable(const std::filesystem::path& directory, std::uint64_t key,
                     const std::vector<std::int8_t>& sides);

}  // namespace riftmap
