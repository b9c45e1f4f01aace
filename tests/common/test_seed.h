// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdlib>

namespace riftmap {

/// From the environment (RIFTMAP_TEST_SEED) to repeat a failure, else new in each run.
inline std::uint64_t seedOfRun() {
    const char* given = std::getenv("RIFTMAP_TEST_SEED");
    return given != nullptr ? std::strtoull(given, nullptr, 10)
                            : static_cast<std::uint64_t>(
                                  std::chrono::steady_clock::now().time_since_epoch().count());
}

}  // namespace riftmap
