// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/forecast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

namespace riftmap {
namespace {

/// Gains that fall by the same factor a view, from 1 m^2 in view 0 on.
std::vector<double> falling(int views, double factor) {
    std::vector<double> gains(static_cast<std::size_t>(views), 1.0);
    for (std::size_t i = 1; i < gains.size(); ++i) {
        gains[i] = factor * gains[i - 1];
    }
    return gains;
}

std::vector<double> times(std::vector<double> values, double factor) {
    for (double& v : values) {
        v *= factor;
    }
    return values;
}

double total(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) {
        sum += v;
    }
    return sum;
}

TEST(Forecast, CarriesAnEvenFallOn) {
    // Views bring half of what they promise. The gain of view 44 is the least that is worth one.
    const auto all = times(falling(45, 0.9), 0.5);
    const auto f = forecast(falling(20, 0.9), times(falling(20, 0.9), 0.5), std::pow(0.9, 44));
    ASSERT_TRUE(f);
    EXPECT_NEAR(f->viewsLeft, 25, 1e-9);
    EXPECT_NEAR(f->share, total({all.begin(), all.begin() + 20}) / total(all), 1e-9);
}

TEST(Forecast, GoesByTheLastViews) {
    // What a wide way promised at first tells nothing of the rest.
    std::vector<double> gains(30, 50.0);
    for (const double g : falling(70, 0.95)) {
        gains.push_back(g);
    }
    const auto f = forecast(gains, gains, std::pow(0.95, 99));
    ASSERT_TRUE(f);
    EXPECT_NEAR(f->viewsLeft, 30, 1e-9);
}

TEST(Forecast, DoesNotAskForAGainOfTheFirstView) {
    auto gains = falling(10, 0.7);
    gains[0] = 0;
    const auto f = forecast(gains, falling(10, 0.7), std::pow(0.7, 14));
    ASSERT_TRUE(f);
    EXPECT_NEAR(f->viewsLeft, 5, 1e-9);
}

TEST(Forecast, SaysNothingWhereNothingCanBeSaid) {
    const double least = 1e-3;
    const auto says = [&](const std::vector<double>& gains) {
        return forecast(gains, falling(static_cast<int>(gains.size()), 0.9), least).has_value();
    };
    EXPECT_TRUE(says(falling(20, 0.8)));
    EXPECT_FALSE(says(falling(9, 0.7))) << "too few views";
    EXPECT_FALSE(says(falling(20, 1.1))) << "gains grow";
    EXPECT_FALSE(says(falling(20, 1.0))) << "gains do not fall";
    auto gap = falling(20, 0.8);
    gap[15] = 0;
    EXPECT_FALSE(says(gap)) << "a view without a promise";
    EXPECT_FALSE(says(std::vector<double>(20, 0.0))) << "a planner that expects nothing";
    EXPECT_FALSE(says(falling(40, 0.8))) << "below the least: any view may be the last";
    const auto gains = falling(20, 0.8);
    EXPECT_FALSE(forecast(gains, gains, 0)) << "nothing that a share is of";
    EXPECT_FALSE(forecast(gains, std::vector<double>(20, 0.0), least)) << "no surface";
}

TEST(Forecast, LooksNoFartherThanTwiceAsManyViews) {
    const auto gains = falling(20, 0.95);
    EXPECT_TRUE(forecast(gains, gains, std::pow(0.95, 19 + 39)));
    EXPECT_FALSE(forecast(gains, gains, std::pow(0.95, 19 + 41)));
}

TEST(Forecast, RefusesWhatIsNotTwoFiguresAView) {
    EXPECT_THROW(forecast(falling(20, 0.9), falling(19, 0.9), 1), std::invalid_argument);
}

}  // namespace
}  // namespace riftmap
