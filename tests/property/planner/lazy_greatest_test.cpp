// SPDX-License-Identifier: BSD-3-Clause
#include "lazy_greatest.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <string>

namespace riftmap {
namespace {

TEST(GreatestOf, isThatOfAllValuesAndAsksForFew) {
    std::size_t asked = 0;
    std::size_t all = 0;
    for (unsigned seed = 1; seed <= 200; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        std::vector<double> exact(1 + random() % 100);
        std::vector<double> values(exact.size());
        const double doubt = (seed % 4) / 2.0;  // how far the bounds lie above
        for (std::size_t i = 0; i < exact.size(); ++i) {
            exact[i] = static_cast<double>(random() % 20) - (seed % 10 == 0 ? 25.0 : 2.0);
            values[i] = exact[i] + doubt * static_cast<double>(random() % 8);
        }
        std::size_t slow = exact.size();
        for (std::size_t i = 0; i < exact.size(); ++i) {
            if (exact[i] > 0 && (slow == exact.size() || exact[i] > exact[slow])) {
                slow = i;
            }
        }
        std::set<std::size_t> some;
        EXPECT_EQ(greatestOf(values,
                             [&](std::span<const std::size_t> indices) {
                                 for (const std::size_t i : indices) {
                                     EXPECT_TRUE(some.insert(i).second) << "asked twice: " << i;
                                     EXPECT_GT(values[i], 0);
                                     values[i] = exact[i];
                                 }
                             }),
                  slow);
        asked += some.size();
        all += exact.size();
    }
    EXPECT_LT(asked, all / 2);
    EXPECT_GT(asked, 200U);
}

TEST(GreatestOf, nothingIsNothing) {
    std::vector<double> none;
    const auto never = [](std::span<const std::size_t>) { FAIL(); };
    EXPECT_EQ(greatestOf(none, never), 0U);
    std::vector<double> zero(3, 0.0);
    EXPECT_EQ(greatestOf(zero, never), 3U);
}

}  // namespace
}  // namespace riftmap
