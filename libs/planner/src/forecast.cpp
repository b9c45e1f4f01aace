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
    const std::size_t recent = std::clamp<std::size_t>(
        static_cast<std::size_t>(kRecent * static_cast<double>(views)), kFewest - 1, views - 1);
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
    const double now = level + slope * middle;
    Forecast result;
    result.viewsLeft = std::max(0.0, (now - std::log(least)) / -slope);
    if (result.viewsLeft > kFarthest * static_cast<double>(views)) {
        return std::nullopt;
    }
    // The gains to come are the area below the line.
    const double toCome = std::max(0.0, (std::exp(now) - least) / -slope);
    const double soFar = sum(seen);
    const double left = toCome * sum(seen.last(recent)) / sum(gains);
    result.share = soFar > 0 ? soFar / (soFar + left) : 1.0;
    return result;
}

}  // namespace riftmap
