// SPDX-License-Identifier: BSD-3-Clause
// The real raw pairs of EuRoC V1_01: after rectification the two images of a corner are on one row.
#include <gtest/gtest.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DQuat.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "riftmap/stereo/rectifier.h"

namespace riftmap {
namespace {

std::string dataFolder() {
    const char* data = std::getenv("RIFTMAP_DATA");
    return (data != nullptr ? std::string(data) : RIFTMAP_SOURCE_DIR "/../shared/data") +
           "/euroc_v1_01_micro/mav0";
}

mrpt::img::TCamera camera(double fx, double fy, double cx, double cy, double k1, double k2,
                          double p1, double p2) {
    mrpt::img::TCamera c;
    c.ncols = 752;
    c.nrows = 480;
    c.setIntrinsicParamsFromValues(fx, fy, cx, cy);
    c.setDistortionPlumbBob(k1, k2, p1, p2);
    return c;
}

/// cam0/sensor.yaml and cam1/sensor.yaml.
mrpt::img::TStereoCamera calibration() {
    mrpt::img::TStereoCamera s;
    s.leftCamera = camera(458.654, 457.296, 367.215, 248.375, -0.28340811, 0.07395907, 0.00019359,
                          1.76187114e-05);
    s.rightCamera = camera(457.587, 456.134, 379.999, 255.238, -0.28368365, 0.07451284, -0.00010473,
                           -3.55590700e-05);
    Pose left, right;
    left.rotation << 0.0148655429818, -0.999880929698, 0.00414029679422, 0.999557249008,
        0.0149672133247, 0.025715529948, -0.0257744366974, 0.00375618835797, 0.999660727178;
    left.translation << -0.0216401454975, -0.064676986768, 0.00981073058949;
    right.rotation << 0.0125552670891, -0.999755099723, 0.0182237714554, 0.999598781151,
        0.0130119051815, 0.0251588363115, -0.0253898008918, 0.0179005838253, 0.999517347078;
    right.translation << -0.0198435579556, 0.0453689425024, 0.00786212447038;
    s.rightCameraPose = mrpt::poses::CPose3DQuat(toMrpt(left.inverse() * right)).asTPose();
    return s;
}

/// Where the parabola through three neighbouring scores is highest.
double peak(float before, float at, float after) {
    const double bend =
        static_cast<double>(before) - 2.0 * static_cast<double>(at) + static_cast<double>(after);
    return bend < 0 ? 0.5 * static_cast<double>(before - after) / bend : 0;
}

/// Row of each corner's image on the right minus that on the left [px].
std::vector<double> rowDifferences(const cv::Mat& left, const cv::Mat& right) {
    constexpr int kHalf = 7, kRows = 4, kRange = 80;
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(left, corners, 400, 0.02, 8);
    std::vector<double> differences;
    for (const auto& corner : corners) {
        const int x = cvRound(corner.x), y = cvRound(corner.y);
        const cv::Rect patch(x - kHalf, y - kHalf, 2 * kHalf + 1, 2 * kHalf + 1);
        const cv::Rect strip(x - kHalf - kRange, y - kHalf - kRows, 2 * kHalf + 1 + kRange,
                             2 * kHalf + 1 + 2 * kRows);
        const cv::Rect image({0, 0}, left.size());
        if ((patch & image) != patch || (strip & image) != strip) {
            continue;
        }
        cv::Mat score;
        cv::matchTemplate(right(strip), left(patch), score, cv::TM_CCOEFF_NORMED);
        double best = 0;
        cv::Point at;
        cv::minMaxLoc(score, nullptr, &best, nullptr, &at);
        if (best > 0.95 && at.y > 0 && at.y < score.rows - 1) {
            differences.push_back(at.y - kRows +
                                  peak(score.at<float>(at.y - 1, at.x), score.at<float>(at),
                                       score.at<float>(at.y + 1, at.x)));
        }
    }
    return differences;
}

TEST(RectificationData, RowsOfEurocAgree) {
    const std::filesystem::path folder = dataFolder();
    if (!std::filesystem::exists(folder / "cam0/data")) {
        GTEST_SKIP() << "SKIPPED: no EuRoC pairs in " << folder << " (set RIFTMAP_DATA)";
    }
    const auto camera = calibration();
    Rectifier rectifier;
    std::vector<double> raw, rectified;
    int pairs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "cam0/data")) {
        const auto other = folder / "cam1/data" / entry.path().filename();
        const cv::Mat left = cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE);
        const cv::Mat right = cv::imread(other.string(), cv::IMREAD_GRAYSCALE);
        ASSERT_FALSE(left.empty() || right.empty()) << entry.path();
        RectifiedPair pair;
        rectifier.rectify(camera, left, right, pair);
        EXPECT_NEAR(pair.camera.baseline, 0.110, 0.001);
        const auto before = rowDifferences(left, right);
        const auto after = rowDifferences(pair.left, pair.right);
        raw.insert(raw.end(), before.begin(), before.end());
        rectified.insert(rectified.end(), after.begin(), after.end());
        ++pairs;
    }
    ASSERT_GT(pairs, 0);
    ASSERT_GT(rectified.size(), 50U * static_cast<std::size_t>(pairs));
    const auto quantile = [](std::vector<double> values, double share) {
        std::transform(values.begin(), values.end(), values.begin(),
                       [](double v) { return std::abs(v); });
        std::sort(values.begin(), values.end());
        return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
    };
    std::cout << pairs << " pairs, " << rectified.size() << " corners: rows differ by "
              << quantile(rectified, 0.5) << " px (median), " << quantile(rectified, 0.9)
              << " px (90 %); raw: " << (raw.empty() ? -1 : quantile(raw, 0.5)) << " px\n";
    EXPECT_LT(quantile(rectified, 0.5), 0.25);
    EXPECT_LT(quantile(rectified, 0.9), 0.5);
}

}  // namespace
}  // namespace riftmap
