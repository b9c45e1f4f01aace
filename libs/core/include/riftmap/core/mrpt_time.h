// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/core/Clock.h>

#include <cstdint>

namespace riftmap {

/// Ticks of mrpt::Clock (100 ns since 1601-01-01) at the Unix epoch.
inline constexpr std::int64_t kMrptTicksAtEpoch = 116444736000000000LL;

/// Nanoseconds since the Unix epoch -> MRPT's clock; exact to its 100 ns (Clock::fromDouble is
/// not: a double holds today's time to 240 ns).
inline mrpt::Clock::time_point toMrptTime(std::int64_t time_ns) {
    // Rounded down, also before 1970.
    const std::int64_t ticks = time_ns / 100 - (time_ns % 100 < 0 ? 1 : 0);
    return mrpt::Clock::time_point(mrpt::Clock::duration(ticks + kMrptTicksAtEpoch));
}

/// MRPT's clock -> nanoseconds since the Unix epoch.
inline std::int64_t fromMrptTime(mrpt::Clock::time_point time) {
    return (time.time_since_epoch().count() - kMrptTicksAtEpoch) * 100;
}

}  // namespace riftmap
