// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

namespace riftmap {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(Progress, TellsShareRateAndTimeLeft) {
    std::ostringstream out;
    const Progress progress("building", "views", 40, out, false);
    EXPECT_EQ(progress.line(0, 0), "building 0/40 views (0 %)");
    EXPECT_EQ(progress.line(10, 2.0), "building 10/40 views (25 %), 5 views/s, 6 s left");
    EXPECT_EQ(progress.line(1, 10.0), "building 1/40 views (2 %), 0.1 views/s, 6 min 30 s left");
    EXPECT_EQ(progress.line(1, 100.0), "building 1/40 views (2 %), 0.01 views/s, 1 h 5 min left");
    EXPECT_EQ(progress.line(40, 8.0), "building 40/40 views (100 %), 5 views/s, took 8 s");
    const Progress endless("exploring", "views", 0, out, false);
    EXPECT_EQ(endless.line(10, 2.0), "exploring 10 views, 5 views/s, took 2 s");
}

TEST(Progress, ALogFileGetsALineATenth) {
    std::ostringstream out;
    {
        Progress progress("a", "b", 1000, out, false);
        for (std::size_t i = 1; i <= 1000; ++i) {
            progress.update(i);
        }
    }
    const std::string text = out.str();
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 10);
    EXPECT_EQ(std::count(text.begin(), text.end(), '\r'), 0);
    EXPECT_THAT(text, StartsWith("a 100/1000 b (10 %)"));
}

TEST(Progress, ATerminalGetsOneLineThatRefreshes) {
    std::ostringstream out;
    {
        Progress progress("a", "b", 1000, out, true);
        for (std::size_t i = 1; i <= 1000; ++i) {
            progress.update(i);
        }
    }
    const std::string text = out.str();
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
    EXPECT_THAT(text, StartsWith("\ra 1/1000 b (0 %)"));
    EXPECT_THAT(text, HasSubstr("a 1000/1000 b (100 %)"));
    EXPECT_THAT(text, EndsWith("\n"));
}

TEST(Progress, SilentWhenOff) {
    testing::internal::CaptureStderr();
    {
        Progress progress("a", "b", 10, false);
        progress.update(10);
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace riftmap
