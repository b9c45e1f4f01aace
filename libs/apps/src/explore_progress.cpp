// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/explore_progress.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <vector>

#include "riftmap/core/progress.h"

namespace riftmap {

namespace {

double medianStep(std::span<const double> seconds) {
    std::vector<double> steps;
    for (std::size_t i = seconds.size() / 2; i < seconds.size(); ++i) {
        steps.push_back(seconds[i] - seconds[i - 1]);
    }
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    return *middle;
}

}  // namespace

std::string forecastText(const Forecast& ahead, std::span<const double> seconds,
                         std::size_t maxViews) {
    if (seconds.size() < 2) {
        throw std::invalid_argument("a forecast needs the times of two views");
    }
    const auto toLimit = maxViews - std::min(maxViews, seconds.size());
    const auto wanted = static_cast<std::size_t>(std::ceil(ahead.viewsLeft));
    const bool limited = toLimit < wanted;
    const std::size_t views = std::min(wanted, toLimit);
    char share[32];
    std::snprintf(share, sizeof share, "%.1f", 100 * ahead.share);
    return std::string("about ") + share + " % of what it " + (limited ? "would" : "will") +
           " see, " + std::to_string(views) + (views == 1 ? " view and " : " views and ") +
           durationText(static_cast<double>(views) * medianStep(seconds)) +
           (limited ? " to max_views" : " left");
}

}  // namespace riftmap
