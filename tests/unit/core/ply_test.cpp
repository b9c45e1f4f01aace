// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/ply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
using Colour = std::array<std::uint8_t, 3>;

PointCloud randomCloud(std::size_t n, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<float> gauss;
    std::uniform_int_distribution<int> byte(0, 255);
    PointCloud cloud;
    for (std::size_t i = 0; i < n; ++i) {
        cloud.points.emplace_back(gauss(random), gauss(random), gauss(random));
        cloud.normals.emplace_back(gauss(random), gauss(random), gauss(random));
        cloud.colours.push_back({static_cast<std::uint8_t>(byte(random)),
                                 static_cast<std::uint8_t>(byte(random)),
                                 static_cast<std::uint8_t>(byte(random))});
    }
    return cloud;
}

TEST(Ply, RoundTripKeepsEveryBit) {
    const TemporaryFolder folder;
    for (const std::size_t n : {0U, 1U, 100000U}) {
        const PointCloud cloud = randomCloud(n, 7);
        writePly(folder / "a.ply", cloud, {"made by a test"});
        const PointCloud back = readPly(folder / "a.ply");
        EXPECT_EQ(back.points, cloud.points);
        EXPECT_EQ(back.normals, cloud.normals);
        EXPECT_EQ(back.colours, cloud.colours);
    }
}

TEST(Ply, WritesTheFixedLayout) {
    const TemporaryFolder folder;
    PointCloud cloud;
    cloud.points.emplace_back(1.0F, 2.0F, 0.0F);
    writePly(folder / "a.ply", cloud);
    std::string expected =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n"
        "property float y\nproperty float z\nproperty float nx\nproperty float ny\n"
        "property float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        "end_header\n";
    expected += std::string("\0\0\x80\x3F\0\0\0\x40", 8) + std::string(16, '\0') + "\xFF\xFF\xFF";
    EXPECT_EQ(readFile(folder / "a.ply"), expected);
}

TEST(Ply, ReadsAsciiWithForeignPropertiesAndFaces) {
    const TemporaryFolder folder;
    const PointCloud cloud = readPly(folder.write(
        "a.ply",
        "ply\r\nformat ascii 1.0\r\ncomment x\r\nobj_info y\r\nelement material 1\r\n"
        "property list uchar int ids\r\nproperty int shade\r\nelement vertex 2\r\n"
        "property float confidence\r\nproperty double z\r\nproperty double y\r\n"
        "property double x\r\nproperty list uchar float weights\r\nproperty float red\r\n"
        "property float green\r\nproperty float blue\r\nelement face 1\r\n"
        "property list uchar int vertex_indices\r\nend_header\r\n"
        "3 7 8 9 5\r\n0.5 3 2 1e0 2 9 9 0 0.5 1\r\n0.5 +6 5 -4 0 1 2 -1\r\n3 0 1 0\r\n"));
    ASSERT_EQ(cloud.points.size(), 2U);
    EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1, 2, 3));
    EXPECT_EQ(cloud.points[1], Eigen::Vector3f(-4, 5, 6));
    EXPECT_TRUE(cloud.normals.empty());
    EXPECT_EQ(cloud.colours, (std::vector<Colour>{{0, 128, 255}, {255, 255, 0}}));
}

TEST(Ply, ReadsBigEndianOfEveryType) {
    const TemporaryFolder folder;
    const std::string header =
        "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty int8 a\nproperty short x\n"
        "property uint16 b\nproperty list int32 uint16 c\nproperty int y\nproperty uint z\n"
        "property float64 nx\nproperty float32 ny\nproperty char nz\nend_header\n";
    const std::string data("\xFF\xFF\xFE\x01\x02\0\0\0\x01\x01\x02\0\0\x01\0\0\0\0\x07", 19);
    const std::string normal("\x3F\xF0\0\0\0\0\0\0\x40\0\0\0\xFD", 13);
    const PointCloud cloud = readPly(folder.write("a.ply", header + data + normal));
    ASSERT_EQ(cloud.points.size(), 1U);
    EXPECT_EQ(cloud.points[0], Eigen::Vector3f(-2, 256, 7));
    EXPECT_EQ(cloud.normals[0], Eigen::Vector3f(1, 2, -3));
    EXPECT_TRUE(cloud.colours.empty());
}

TEST(Ply, BrokenFilesAreNamedWithThePlace) {
    const TemporaryFolder folder;
    const auto message = [&](const std::string& bytes) {
        const auto file = folder.write("x.ply", bytes);
        std::string m = messageOf<FileError>([&] { readPly(file); });
        EXPECT_THAT(m, HasSubstr("x.ply:"));
        EXPECT_THAT(m, ::testing::Not(HasSubstr("\n")));
        return m;
    };
    const std::string ascii = "ply\nformat ascii 1.0\n";
    const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
    EXPECT_THAT(message(""), HasSubstr("no end"));
    EXPECT_THAT(message("plx\n"), HasSubstr("x.ply:1: not a PLY"));
    EXPECT_THAT(message("ply\nformat ascii 2.0\n"), HasSubstr("x.ply:2: the format"));
    EXPECT_THAT(message("ply\nend_header\n"), HasSubstr("no format"));
    EXPECT_THAT(message(ascii + "element vertex -1\n"), HasSubstr("x.ply:3: not 'element"));
    EXPECT_THAT(message(ascii + "property float x\n"), HasSubstr("before the first element"));
    EXPECT_THAT(message(ascii + "element vertex 1\nproperty floot x\n"),
                HasSubstr("x.ply:4: unknown type 'floot'"));
    EXPECT_THAT(message(ascii + "vertices 3\n"), HasSubstr("unknown keyword 'vertices'"));
    EXPECT_THAT(message(ascii + "element vertex 1\n" + xyz), HasSubstr("no end"));
    EXPECT_THAT(message(ascii + "element face 0\nend_header\n"), HasSubstr("no vertices"));
    EXPECT_THAT(message(ascii + "element vertex 1\nproperty float x\nend_header\n1\n"),
                HasSubstr("no x y z"));
    EXPECT_THAT(message(ascii + "element vertex 2\n" + xyz + "end_header\n1 2 3\n4 5\n"),
                HasSubstr("ends too early"));
    EXPECT_THAT(message(ascii + "element vertex 1\n" + xyz + "end_header\n1 2 three\n"),
                HasSubstr("'three' is not a number"));
    EXPECT_THAT(message(ascii + "element vertex 1\n" + xyz + "end_header\n1 2 nan\n"),
                HasSubstr("vertex 0 is not finite"));
    const std::string binary = "ply\nformat binary_little_endian 1.0\n";
    EXPECT_THAT(message(binary + "element vertex 4000000000000\n" + xyz + "end_header\nabc"),
                HasSubstr("ends too early"));
    EXPECT_THAT(message(binary +
                        "element face 1\nproperty list uint8 float64 i\n"
                        "element vertex 0\n" +
                        xyz +
                        "end_header\n\xFF"
                        "abc"),
                HasSubstr("ends too early"));
    EXPECT_THAT(message(binary +
                        "element face 1\nproperty list int8 float64 i\n"
                        "element vertex 0\n" +
                        xyz +
                        "end_header\n\xFF"
                        "abc"),
                HasSubstr("a list of -1"));
}

TEST(Ply, RefusesWhatDoesNotFitTogether) {
    const TemporaryFolder folder;
    PointCloud cloud = randomCloud(3, 1);
    EXPECT_THROW(writePly(folder / "a.ply", cloud, {"two\nlines"}), std::invalid_argument);
    cloud.normals.pop_back();
    EXPECT_THROW(writePly(folder / "a.ply", cloud), std::invalid_argument);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace riftmap
