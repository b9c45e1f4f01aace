// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/pfm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "riftmap/core/file.h"
#include "temporary_folder.h"

namespace riftmap {
namespace {

using test::messageOf;
using test::TemporaryFolder;
using ::testing::HasSubstr;

TEST(Pfm, RoundTripKeepsEveryBit) {
    const TemporaryFolder folder;
    constexpr float kInf = std::numeric_limits<float>::infinity();
    const FloatImage image{3, 2, {0.1F, kInf, -2.5F, 1e-30F, 63.99F, 0.0F}};
    writePfm(folder / "d.pfm", image);
    const FloatImage back = readPfm(folder / "d.pfm");
    EXPECT_EQ(back.width, 3);
    EXPECT_EQ(back.height, 2);
    EXPECT_EQ(back.values, image.values);
}

TEST(Pfm, RowsRunFromTheBottomAndScaleTellsTheByteOrder) {
    const TemporaryFolder folder;
    // 1.0F is 3F 80 00 00, 2.0F is 40 00 00 00; big-endian, so the positive scale.
    const std::string one = {'\x3F', '\x80', '\0', '\0'}, two = {'\x40', '\0', '\0', '\0'};
    const FloatImage big = readPfm(folder.write("big.pfm", "Pf\n1 2\n1.0\n" + one + two));
    EXPECT_EQ(big.values, (std::vector<float>{2, 1}));
    const std::string littleOne = {'\0', '\0', '\x80', '\x3F'};
    const FloatImage little = readPfm(folder.write("little.pfm", "Pf 1 1\t-0.0039\n" + littleOne));
    EXPECT_EQ(little.values, (std::vector<float>{1}));
    writePfm(folder / "out.pfm", little);
    EXPECT_EQ(readFile(folder / "out.pfm"), "Pf\n1 1\n-1.0\n" + littleOne);
}

TEST(Pfm, BrokenFilesAreNamedWithThePlace) {
    const TemporaryFolder folder;
    const auto message = [&](const std::string& bytes) {
        const auto file = folder.write("x.pfm", bytes);
        std::string m = messageOf<FileError>([&] { readPfm(file); });
        EXPECT_THAT(m, HasSubstr("x.pfm: byte "));
        return m;
    };
    EXPECT_THAT(message(""), HasSubstr("not a PFM"));
    EXPECT_THAT(message("P6\n1 1\n255\nabc"), HasSubstr("not a PFM"));
    EXPECT_THAT(message("PF\n1 1\n-1\n"), HasSubstr("colour"));
    EXPECT_THAT(message("Pf\nx 1\n-1\n"), HasSubstr("byte 3: width 'x'"));
    EXPECT_THAT(message("Pf\n1 0\n-1\n"), HasSubstr("byte 5: height '0'"));
    EXPECT_THAT(message("Pf\n1 99999999\n-1\n"), HasSubstr("height"));
    EXPECT_THAT(message("Pf\n1 1\n0\nabcd"), HasSubstr("scale"));
    EXPECT_THAT(message("Pf\n1 1\n"), HasSubstr("scale"));
    EXPECT_THAT(message("Pf\n2 1\n-1\nabcd"), HasSubstr("8 bytes of pixels must follow, not 4"));
    EXPECT_THAT(message("Pf\n1 1\n-1\nabcdX"), HasSubstr("4 bytes of pixels must follow, not 5"));
    EXPECT_THAT(messageOf<FileError>([&] { readPfm(folder / "none.pfm"); }),
                HasSubstr("none.pfm: no such file"));
    EXPECT_THROW(writePfm(folder / "y.pfm", {2, 2, {1, 2, 3}}), std::invalid_argument);
    EXPECT_FALSE(std::filesystem::exists(folder / "y.pfm"));
}

}  // namespace
}  // namespace riftmap
