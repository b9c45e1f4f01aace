// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/whole.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace riftmap {
namespace {

template <class T>
void expectFloor(T x) {
    EXPECT_EQ(wholeBelow(x), static_cast<int>(std::floor(x))) << "of " << x;
}

TEST(WholeBelow, IsFloor) {
    std::mt19937 random(1);
    for (int i = -1000; i <= 1000; ++i) {
        const auto whole = static_cast<float>(i);
        for (const float x :
             {whole, std::nextafter(whole, -2000.0F), std::nextafter(whole, 2000.0F),
              whole + static_cast<float>(random()) / 4294967296.0F}) {
            expectFloor(x);
            expectFloor(static_cast<double>(x));
        }
        expectFloor(std::nextafter(static_cast<double>(i), -2000.0));
        expectFloor(std::nextafter(static_cast<double>(i), 2000.0));
    }
    expectFloor(-0.0F);
    expectFloor(std::numeric_limits<double>::denorm_min());
    expectFloor(-std::numeric_limits<double>::denorm_min());
    EXPECT_EQ(wholesBelow(Eigen::Vector3d(-0.5, 2.0, 3.7)), Eigen::Vector3i(-1, 2, 3));
}

}  // namespace
}  // namespace riftmap
