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
    std::vector<double> gains;
    for (int i = 0; i < views; ++i) {
        gains.push_back(std::pow(factor, i));
    }
    return gains;
}

std::vector<double> times(std::vector<double> values, double factor) {
    for (double& v : values) {
        v *= factor;
    }
    return values;
}

TEST(Forecast, CarriesAnEvenFallOn) {
    const double factor = 0.9;
    const auto gains = falling(20, factor);
    // Views bring half of what they promise. From 0.9^19 it takes 25 views to 0.9^44.
    const auto f = forecast(gains, times(gains, 0.5), std::pow(factor, 44));
    ASSERT_TRUE(f);
    EXPECT_NEAR(f->viewsLeft, 25, 1e-9);
    const double soFar = 0.5 * (1 - std::pow(factor, 20)) / (1 - factor);
    const double left = 0.5 * (std::pow(factor, 19) - std::pow(factor, 44)) / -std::log(factor);
    EXPECT_NEAR(f->share, soFar / (soFar + left), 1e-9);
}

TEST(Forecast, KnowsTheEnd) {
    const auto gains = falling(20, 0.9);
    const auto f = forecast(gains, gains, 2 * gains.back());
    ASSERT_TRUE(f);
    EXPECT_EQ(f->viewsLeft, 0);
    EXPECT_EQ(f->share, 1);
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

TEST(Forecast, SaysNothingWhereNothingCanBeSaid) {
    const double least = 1e-3;
    EXPECT_FALSE(forecast(falling(9, 0.9), falling(9, 0.9), least)) << "too few views";
    EXPECT_TRUE(forecast(falling(10, 0.7), falling(10, 0.7), least));
    EXPECT_FALSE(forecast(falling(20, 1.1), falling(20, 1.1), least)) << "gains grow";
    EXPECT_FALSE(forecast(falling(20, 1.0), falling(20, 1.0), least)) << "gains do not fall";
    EXPECT_FALSE(forecast(falling(20, 0.999), falling(20, 0.999), least)) << "far away";
    EXPECT_FALSE(forecast(falling(20, 0.9), falling(20, 0.9), 0)) << "no surface";
    const std::vector<double> none(20, 0.0);
    EXPECT_FALSE(forecast(none, falling(20, 0.9), least)) << "a planner that expects nothing";
}

TEST(Forecast, OfAMapWithoutSurfaceIsOfNone) {
    const std::vector<double> none(20, 0.0);
    const auto f = forecast(falling(20, 0.8), none, 1e-3);
    ASSERT_TRUE(f);
    EXPECT_EQ(f->share, 1);
}

TEST(Forecast, RefusesWhatIsNotTwoFiguresAView) {
    EXPECT_THROW(forecast(falling(20, 0.9), falling(19, 0.9), 1), std::invalid_argument);
}

}  // namespace
}  // namespace riftmap
