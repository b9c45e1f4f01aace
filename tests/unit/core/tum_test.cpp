// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/tum.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "riftmap/core/file.h"
#include "temporary_folder.h"

namespace riftmap {
namespace {

using test::messageOf;
using test::TemporaryFolder;
using ::testing::HasSubstr;

TEST(Tum, RoundTrip) {
    const TemporaryFolder folder;
    std::mt19937_64 random(3);
    std::normal_distribution<double> gauss;
    std::vector<TimedPose> trajectory;
    for (int i = 0; i < 200; ++i) {
        const Eigen::Quaterniond q(gauss(random), gauss(random), gauss(random), gauss(random));
        trajectory.push_back({1403636579763555584 + i * 1000000007LL,
                              {q.normalized().toRotationMatrix(),
                               {gauss(random), gauss(random), 1e3 * gauss(random)}}});
    }
    writeTum(folder / "t.tum", trajectory);
    const auto back = readTum(folder / "t.tum");
    ASSERT_EQ(back.size(), trajectory.size());
    for (std::size_t i = 0; i < back.size(); ++i) {
        EXPECT_EQ(back[i].time_ns, trajectory[i].time_ns);
        EXPECT_EQ(back[i].pose.translation, trajectory[i].pose.translation);
        EXPECT_TRUE(back[i].pose.rotation.isApprox(trajectory[i].pose.rotation, 1e-14));
    }
}

TEST(Tum, OrderOfTheNumbersAndComments) {
    const TemporaryFolder folder;
    // A quarter turn about z takes x to y.
    const auto poses = readTum(
        folder.write("t.tum",
                     "# t x y z qx qy qz qw\n\n  1.5 1 2 3 0 0 0.70710678 0.70710678 # one\r\n"
                     "1.4e1\t0 0 0 0 0 0 1\n"));
    ASSERT_EQ(poses.size(), 2U);
    EXPECT_EQ(poses[0].time_ns, 1500000000);
    EXPECT_EQ(poses[0].pose.translation, Eigen::Vector3d(1, 2, 3));
    EXPECT_TRUE((poses[0].pose.rotation * Eigen::Vector3d::UnitX())
                    .isApprox(Eigen::Vector3d::UnitY(), 1e-12));
    EXPECT_EQ(poses[1].time_ns, 14000000000);
    EXPECT_EQ(tumLine(poses[1]), "14.000000000 0 0 0 0 0 0 1");
}

TEST(Tum, TimesAreExact) {
    EXPECT_EQ(nanosecondsFromText("1403636579.763555584"), 1403636579763555584);
    EXPECT_EQ(nanosecondsFromText("1.403636579763555584e+09"), 1403636579763555584);
    EXPECT_EQ(nanosecondsFromText("1403636579763555584E-9"), 1403636579763555584);
    EXPECT_EQ(nanosecondsFromText("0.0000000004"), 0);
    EXPECT_EQ(nanosecondsFromText("0.0000000005"), 1);
    EXPECT_EQ(nanosecondsFromText("-.5"), -500000000);
    EXPECT_EQ(nanosecondsFromText("1e-30"), 0);
    EXPECT_EQ(nanosecondsFromText("7."), 7000000000);
    for (const char* bad : {"", ".", "1.2.3", "abc", "1e", "1e+", "1x", "--1", "1e500",
                            "99999999999", "nan", "1 2"}) {
        EXPECT_THROW(nanosecondsFromText(bad), std::invalid_argument) << bad;
    }
    for (const std::int64_t t :
         {std::int64_t{0}, std::int64_t{1}, std::int64_t{-1}, std::int64_t{999999999},
          std::int64_t{1000000000}, std::int64_t{-1500000000}, std::int64_t{1403636579763555584}}) {
        EXPECT_EQ(nanosecondsFromText(textFromNanoseconds(t)), t);
    }
    EXPECT_EQ(textFromNanoseconds(-1), "-0.000000001");
    EXPECT_EQ(textFromNanoseconds(std::numeric_limits<std::int64_t>::min()),
              "-9223372036.854775808");
}

TEST(Tum, BrokenFilesAreNamedWithTheLine) {
    const TemporaryFolder folder;
    const auto message = [&](const std::string& second) {
        const auto file = folder.write("x.tum", "1 0 0 0 0 0 0 1\n" + second + "\n");
        std::string m = messageOf<FileError>([&] { readTum(file); });
        EXPECT_THAT(m, HasSubstr("x.tum:2: "));
        return m;
    };
    EXPECT_THAT(message("2 0 0 0 0 0 1"), HasSubstr("7 fields"));
    EXPECT_THAT(message("2 0 0 0 0 0 0 1 9"), HasSubstr("9 fields"));
    EXPECT_THAT(message("2 0 nan 0 0 0 0 1"), HasSubstr("'nan' is not a finite number"));
    EXPECT_THAT(message("2 0 0,5 0 0 0 0 1"), HasSubstr("'0,5'"));
    EXPECT_THAT(message("2 0 0 0 0 0 0 0"), HasSubstr("norm 0"));
    EXPECT_THAT(message("2 0 0 0 0 0 0 1.5"), HasSubstr("norm 1.5"));
    EXPECT_THAT(message("two 0 0 0 0 0 0 1"), HasSubstr("'two' is not a time"));
    EXPECT_THAT(message("1 0 0 0 0 0 0 1"), HasSubstr("not after"));
    EXPECT_THAT(message("0.5 0 0 0 0 0 0 1"), HasSubstr("not after"));
    EXPECT_THAT(messageOf<FileError>([&] { readTum(folder / "none"); }), HasSubstr("no such file"));
}

TEST(Tum, RefusesToWriteWhatItWouldNotRead) {
    const TemporaryFolder folder;
    Pose broken;
    broken.translation.x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(writeTum(folder / "t.tum", {{1, broken}}), std::invalid_argument);
    EXPECT_THROW(writeTum(folder / "t.tum", {{1, {}}, {1, {}}}), std::invalid_argument);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace riftmap
