// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "riftmap/planner/forecast.h"

namespace riftmap {

/// A forecast in words: "about 98.7 % of what it will see, 30 views and 21 s left", or, where the
/// limit on views comes first, "about 70.9 % of what it would see, 10 views and 7 s to max_views".
/// @param seconds since the run began, as each view was done, in order [s]; two at least. The
/// median step of the last half is the time of a view: when a run is resumed there is one long
/// step.
/// @param maxViews limit of the run, at least as many as were taken unless a run is resumed. Limits
/// on metres and seconds are not looked at.
std::string forecastText(const Forecast& ahead, std::span<const double> seconds,
                         std::size_t maxViews);

}  // namespace riftmap
