// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/disparity_program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
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

TEST_F(DisparityProgramTest, SaysWhatIsWrong) {
    const std::string l = path("l.png"), r = path("r.png"), out = path("x.pfm");
    EXPECT_EQ(run({l, path("none.png"), "--out", out}), 1);
    EXPECT_THAT(error_, HasSubstr("none.png: no such file"));
    EXPECT_EQ(run({l, path("text.png"), "--out", out}), 1);
    EXPECT_THAT(error_, HasSubstr("text.png: not an image"));
    EXPECT_EQ(run({l, path("small.png"), "--out", out}), 1);
    EXPECT_THAT(error_, HasSubstr("200 x 80, right image 100 x 80"));
    EXPECT_EQ(run({l, r, "--out", path("x.png")}), 2);
    EXPECT_EQ(run({l, r, "--out", out, "--matcher", "papr"}), 2);
    EXPECT_EQ(run({l, r, "--out", out, "--set", "Stereo.window=10"}), 2);
    EXPECT_THAT(error_, HasSubstr("odd"));
    EXPECT_EQ(run({l, r, "--out", out, "--time", "0"}), 2);
    EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace riftmap
