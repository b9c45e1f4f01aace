// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/text.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string_view>
#include <vector>

namespace riftmap {
namespace {

TEST(Text, NumbersReadBackToTheSame) {
    for (const double x : {0.1, 1.0 / 3, 1e300, -5e-324, 0.0}) {
        EXPECT_EQ(toDouble(toText(x)), x);
    }
    EXPECT_EQ(toText(0.1F), "0.1");
    EXPECT_EQ(toText(std::uint64_t{18446744073709551615U}), "18446744073709551615");
    for (const char* bad : {"", " 1", "1 ", "1x", "1,5", "0x10", "--1"}) {
        EXPECT_FALSE(toDouble(bad)) << bad;
        EXPECT_FALSE(toInteger(bad)) << bad;
    }
    EXPECT_FALSE(toInteger("99999999999999999999"));
    EXPECT_FALSE(toInteger("1.5"));
}

TEST(Text, WordsAndTrimming) {
    EXPECT_EQ(words(" a\tbc  d\r\n"), (std::vector<std::string_view>{"a", "bc", "d"}));
    EXPECT_TRUE(words("  ").empty());
    EXPECT_EQ(trimmed(" \ta b\r\n"), "a b");
    EXPECT_EQ(trimmed(" "), "");
}

TEST(Text, NearestName) {
    EXPECT_EQ(nearestName("lenght", {"width", "Length", "height"}), "Length");
    EXPECT_EQ(nearestName("a", {}), "");
}

TEST(Text, OneLine) {
    EXPECT_EQ(oneLine("a\n  b\n"), "a b");
    EXPECT_EQ(oneLine("==== MRPT exception ====\nMessage:  bad\npose\nLocation: x.cpp:3: [f\nCall "
                      "stack backtrace:\n[0 ] f\n"),
              "bad pose");
    // Nested: the cause, and no more when what came out goes through again.
    const auto cause = oneLine(
        "==== MRPT exception ====\nMessage:  while reading\nOriginal exception:\n==== MRPT "
        "exception "
        "====\nMessage:  cut\nLocation: a.cpp:1\nCall stack backtrace:\nLocation: b.cpp:2\n");
    EXPECT_EQ(cause, "cut");
    EXPECT_EQ(oneLine("x.rawlog: " + cause), "x.rawlog: cut");
    EXPECT_EQ(oneLine("no Message: of MRPT's, no Location: either"),
              "no Message: of MRPT's, no Location: either");
    EXPECT_EQ(oneLine(" \n"), "unknown error");
}

}  // namespace
}  // namespace riftmap
