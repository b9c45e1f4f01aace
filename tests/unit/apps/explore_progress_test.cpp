// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/explore_progress.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace riftmap {
namespace {

const std::vector<double> kEverySecond = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};

TEST(ForecastText, SaysWhatIsLeft) {
    EXPECT_EQ(forecastText({29.2, 0.9874}, kEverySecond, 100),
              "about 98.7 % of what it will see, 30 views and 30 s left");
    EXPECT_EQ(forecastText({0.3, 0.9999}, kEverySecond, 100),
              "about 100.0 % of what it will see, 1 view and 1 s left");
}

TEST(ForecastText, EndsAtTheLimit) {
    EXPECT_EQ(forecastText({29.2, 0.709}, kEverySecond, 14),
              "about 70.9 % of what it would see, 4 views and 4 s to max_views");
    EXPECT_EQ(forecastText({5, 0.709}, kEverySecond, 15),
              "about 70.9 % of what it will see, 5 views and 5 s left");
    EXPECT_EQ(forecastText({5, 0.709}, kEverySecond, 8),
              "about 70.9 % of what it would see, 0 views and 0 s to max_views")
        << "resumed under a lower limit";
}

TEST(ForecastText, GoesByTheLastHalfAndNotByALongStep) {
    const std::vector<double> slow = {10, 20, 30, 40, 50, 51, 52, 600, 601, 602};
    EXPECT_EQ(forecastText({7, 0.5}, slow, 100),
              "about 50.0 % of what it will see, 7 views and 7 s left");
    EXPECT_EQ(forecastText({7, 0.5}, std::vector<double>{1, 4}, 100),
              "about 50.0 % of what it will see, 7 views and 21 s left");
    EXPECT_THROW(forecastText({7, 0.5}, std::vector<double>{1}, 100), std::invalid_argument);
}

}  // namespace
}  // namespace riftmap
