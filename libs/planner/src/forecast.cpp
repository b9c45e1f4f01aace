// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/forecast.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

namespace riftmap {

namespace {

double sum(std::span<const double> values) {
    return std::accumulate(values.begin(), values.end(), 0.0);
}

}  // namespace

std::optional<Forecast> forecast(std::span<const double> expected, std::span<const double> seen,
                                 double least) {
    constexpr std::size_t kFewest = 10;
    constexpr double kRecent = 0.7;
    constexpr double kFarthest = 2;
    if (expected.size() != seen.size()) {
        throw std::invalid_argument(
            "a forecast takes two figures a view: " + std::to_string(expected.size()) + " gains, " +
            std::to_string(seen.size()) + " areas");
    }
    const std::size_t views = expected.size();
    if (views < kFewest || !(least > 0)) {
        return std::nullopt;
    }
    const std::size_t recent =
        std::max(kFewest - 1, static_cast<std::size_t>(kRecent * static_cast<double>(views)));
    const auto gains = expected.last(recent);
    if (!std::all_of(gains.begin(), gains.end(), [](double g) { return g > 0; })) {
        return std::nullopt;
    }
    const double middle = (static_cast<double>(recent) - 1) / 2;
    double level = 0;  // of the line at its middle
    double slope = 0;
    double squares = 0;
    for (std::size_t i = 0; i < recent; ++i) {
        const double x = static_cast<double>(i) - middle;
        level += std::log(gains[i]) / static_cast<double>(recent);
        slope += x * std::log(gains[i]);
        squares += x * x;
    }
    slope /= squares;
    if (!(slope < 0)) {
        return std::nullopt;
    }
    const double now = std::exp(level + slope * middle);
    const double soFar = sum(seen);
    Forecast result;
    result.viewsLeft = std::log(now / least) / -slope;
    if (!(result.viewsLeft > 0) || result.viewsLeft > kFarthest * static_cast<double>(views) ||
        !(soFar > 0)) {
        return std::nullopt;
    }
    // A geometric series: exp(slope) is the factor from view to view.
    const double gainsToCome = (now - least) * std::exp(slope) / -std::expm1(slope);
    result.share = soFar / (soFar + gainsToCome * sum(seen.last(recent)) / sum(gains));
    return result;
}

}  // namespace riftmap
