// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

namespace riftmap {

/// How a run is likely to go on.
struct Forecast {
    double viewsLeft = 0;  ///< until no view is worth it any more; above 0
    double share = 1;  ///< of the surface that the run will have seen then, seen so far (0 .. 1]
};

/// The trend of what plans expect, carried on: over the last 0.7 of the views (nine at least) a
/// line is fitted to the logarithm of the gains, and surface comes true as it did in these views.
/// That is, a gain falls by the same factor a view until it is not worth one (`least`). No more
/// than a rule of thumb: how far it is off in which world stands in doc/results.md (Forecast).
/// @param expected gain of each view [m^2]; the first view, which nobody planned, has none
/// @param seen surface that each view showed first [m^2]
/// @param least gain that a view has to promise to be taken [m^2]
/// @returns nothing before ten views, for planners that expect no gain, while there is no surface,
/// where gains do not fall, where more views would be left than twice as many as were taken, or
/// where the line is below `least` already: then any view may be the last. Throws
/// std::invalid_argument if `expected` and `seen` differ in size. Time linear in the views.
std::optional<Forecast> forecast(std::span<const double> expected, std::span<const double> seen,
                                 double least);

}  // namespace riftmap
