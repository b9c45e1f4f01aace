// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/disparity_program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "riftmap/core/pfm.h"
#include "temporary_folder.h"

namespace riftmap {
namespace {

using ::testing::HasSubstr;

class DisparityProgramTest : public ::testing::Test {
 protected:
    DisparityProgramTest() {
        cv::Mat texture(80, 260, CV_16UC1);
        cv::RNG rng(3);
        rng.fill(texture, cv::RNG::UNIFORM, 0, 4096);  // 12 bits in 16
        cv::imwrite(path("l.png"), texture.colRange(0, 200));
        cv::imwrite(path("r.png"), texture.colRange(12, 212));
        cv::imwrite(path("small.png"), texture.colRange(0, 100));
        std::ofstream(path("text.png")) << "not an image";
    }
    std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
    /// Exit code; what was said on stderr goes to error_.
    int run(const std::vector<std::string>& arguments) {
        DisparityProgram program;
        ::testing::internal::CaptureStderr();
        ::testing::internal::CaptureStdout();
        const int code = runProgram(program, arguments);
        output_ = ::testing::internal::GetCapturedStdout();
        error_ = ::testing::internal::GetCapturedStderr();
        return code;
    }

    test::TemporaryFolder folder_;
    std::string output_, error_;
};

TEST_F(DisparityProgramTest, WritesDisparityAndPicture) {
    for (const char* matcher : {"paper", "opencv_bm", "opencv_sgbm"}) {
        ASSERT_EQ(run({path("l.png"), path("r.png"), "--out", path("d.pfm"), "-w", "--matcher",
                       matcher, "--time", "3", "--set", "Stereo.num_disparities=32"}),
                  0)
            << error_;
        EXPECT_THAT(output_, HasSubstr("median of 3"));
        const FloatImage d = readPfm(path("d.pfm"));
        ASSERT_EQ(d.width, 200);
        ASSERT_EQ(d.height, 80);
        EXPECT_NEAR(d.values[40 * 200 + 120], 12.0F, 0.3F) << matcher;
        EXPECT_FALSE(std::isfinite(d.values[40 * 200 + 3])) << "no partner over the whole range";
        EXPECT_EQ(cv::imread(path("d.png")).cols, 200);
    }
}

/// The same scene in every format that is taken: what differs is how it is stored.
TEST_F(DisparityProgramTest, ColourAnd16BitMatchLikeTheSameGrey) {
    for (const char* side : {"l", "r"}) {
        const cv::Mat deep = cv::imread(path(side + std::string(".png")), cv::IMREAD_UNCHANGED);
        ASSERT_EQ(deep.type(), CV_16UC1);
        cv::Mat grey, colour, deepColour;
        cv::Mat back;
        deep.convertTo(grey, CV_8U, 1.0 / 16);  // 12 bits to 8
        grey.convertTo(back, CV_16U, 16);
        cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGR);
        cv::cvtColor(back, deepColour, cv::COLOR_GRAY2BGR);
        ASSERT_TRUE(cv::imwrite(path(std::string("grey_") + side + ".png"), grey));
        ASSERT_TRUE(cv::imwrite(path(std::string("colour_") + side + ".png"), colour));
        ASSERT_TRUE(cv::imwrite(path(std::string("deep_") + side + ".png"), back));
        ASSERT_TRUE(cv::imwrite(path(std::string("deepcolour_") + side + ".png"), deepColour));
    }
    const auto matched = [&](const std::string& format) {
        EXPECT_EQ(run({path(format + "_l.png"), path(format + "_r.png"), "--out", path("f.pfm"),
                       "-w", "--set", "Stereo.num_disparities=32"}),
                  0)
            << format << ": " << error_;
        return readPfm(path("f.pfm")).values;
    };
    const std::vector<float> grey = matched("grey");
    ASSERT_GT(std::count_if(grey.begin(), grey.end(), [](float d) { return std::isfinite(d); }),
              10000);
    for (const char* format : {"colour", "deep", "deepcolour"}) {
        EXPECT_EQ(matched(format), grey) << format;
    }
}

TEST_F(DisparityProgramTest, TakesAnImageOfOnePixelAndMatchesNothing) {
    ASSERT_TRUE(cv::imwrite(path("one.png"), cv::Mat(1, 1, CV_8UC3, cv::Scalar(1, 2, 3))));
    for (const char* matcher : {"paper", "opencv_bm", "opencv_sgbm"}) {
        ASSERT_EQ(run({path("one.png"), path("one.png"), "--out", path("one.pfm"), "-w",
                       "--matcher", matcher}),
                  0)
            << matcher << ": " << error_;
        EXPECT_EQ(readPfm(path("one.pfm")).values, std::vector<float>{INFINITY});
    }
}

TEST_F(DisparityProgramTest, SaysWhatIsWrong) {
    const std::string l = path("l.png"), r = path("r.png"), out = path("x.pfm");
    EXPECT_EQ(run({l, path("none.png"), "--out", out}), 1);
    EXPECT_THAT(error_, HasSubstr("none.png: no such file"));
    EXPECT_EQ(run({l, path("text.png"), "--out", out}), 1);
    EXPECT_THAT(error_, HasSubstr("text.png: not an image"));
    EXPECT_EQ(run({l, path("small.png"), "--out", out}), 1);
    EXPECT_THAT(error_, HasSubstr("200 x 80, right image 100 x 80"));
    ASSERT_TRUE(cv::imwrite(path("bits8.png"), cv::Mat(80, 200, CV_8UC1, cv::Scalar(7))));
    EXPECT_EQ(run({l, path("bits8.png"), "--out", out}), 1);
    EXPECT_THAT(error_, HasSubstr("a pair has one depth"));
    ASSERT_TRUE(cv::imwrite(path("float.tiff"), cv::Mat(80, 200, CV_32FC1, cv::Scalar(7))));
    EXPECT_EQ(run({path("float.tiff"), path("float.tiff"), "--out", out}), 1);
    EXPECT_THAT(error_, HasSubstr("allowed: 8 or 16 bit"));
    EXPECT_EQ(run({l, "--out", out}), 2);
    EXPECT_EQ(run({l, r, "--out", path("x.png")}), 2);
    EXPECT_EQ(run({l, r, "--out", out, "--matcher", "papr"}), 2);
    EXPECT_EQ(run({l, r, "--out", out, "--set", "Stereo.window=10"}), 2);
    EXPECT_THAT(error_, HasSubstr("odd"));
    EXPECT_EQ(run({l, r, "--out", out, "--time", "0"}), 2);
    EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace riftmap
