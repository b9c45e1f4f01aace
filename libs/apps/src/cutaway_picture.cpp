// SPDX-License-Identifier: BSD-3-Clause
#include "cutaway_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace riftmap {

namespace {

constexpr int kFiner = 2;  ///< drawn so much larger, then made smaller

/// Parallel projection that shows a box as large as the picture allows.
struct Projection {
    Eigen::Matrix3f rotation;  ///< rows: right, down, away
    Eigen::Vector2f offset;
    float scale;

    Projection(const Eigen::Vector3f& min, const Eigen::Vector3f& max, int width, int height) {
        const Eigen::Vector3f away = Eigen::Vector3f(0.55F, 0.62F, -0.85F).normalized();
        const Eigen::Vector3f right = away.cross(Eigen::Vector3f::UnitZ()).normalized();
        rotation << right.transpose(), away.cross(right).transpose(), away.transpose();
        Eigen::Array2f low = Eigen::Array2f::Constant(std::numeric_limits<float>::max());
        Eigen::Array2f high = -low;
        for (int i = 0; i < 8; ++i) {
            const Eigen::Vector3f corner((i & 1) != 0 ? max.x() : min.x(),
                                         (i & 2) != 0 ? max.y() : min.y(),
                                         (i & 4) != 0 ? max.z() : min.z());
            const Eigen::Array2f p = (rotation * corner).head<2>().array();
            low = low.min(p);
            high = high.max(p);
        }
        const Eigen::Array2f size(static_cast<float>(width), static_cast<float>(height));
        scale = 0.94F * (size / (high - low)).minCoeff();
        offset = (size / 2 - scale * (low + high) / 2).matrix();
    }
    Eigen::Vector3f operator()(const Eigen::Vector3f& p) const {
        const Eigen::Vector3f q = rotation * p;
        return {scale * q.x() + offset.x(), scale * q.y() + offset.y(), q.z()};
    }
};

}  // namespace

cv::Mat cutawayPicture(const std::vector<Eigen::Vector3f>& points,
                       const std::vector<Eigen::Vector3f>& normals,
                       const std::vector<std::array<std::uint8_t, 3>>& colours,
                       const std::vector<Pose>& taken, int width, int height) {
    cv::Mat picture(height * kFiner, width * kFiner, CV_8UC3, cv::Scalar(28, 24, 22));
    if (points.empty()) {
        cv::resize(picture, picture, {width, height});
        return picture;
    }
    // A few stray vertices must not make the rest small.
    Eigen::Vector3f min, max;
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<float> values;
        for (std::size_t i = 0; i < points.size(); i += 7) {
            values.push_back(points[i][axis]);
        }
        const auto at = [&](double share) {
            const auto n =
                static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
            std::nth_element(values.begin(), values.begin() + n, values.end());
            return values[static_cast<std::size_t>(n)];
        };
        min[axis] = at(0.002);
        max[axis] = at(0.998);
    }
    const Projection project(min, max, picture.cols, picture.rows);
    const Eigen::Vector3f away = project.rotation.row(2).transpose();
    cv::Mat depth(picture.size(), CV_32F, cv::Scalar(1e30));
    constexpr int kReach = 2;  // [px] half the size of a point
    for (std::size_t i = 0; i < points.size(); ++i) {
        const float facing = -normals[i].dot(away);
        if (facing < 0.02F) {
            continue;
        }
        const Eigen::Vector3f p = project(points[i]);
        const int u = static_cast<int>(std::lround(p.x()));
        const int v = static_cast<int>(std::lround(p.y()));
        const float light = 0.65F + 0.5F * facing;
        const auto shade = [&](std::uint8_t c) {
            return cv::saturate_cast<std::uint8_t>(light * static_cast<float>(c));
        };
        const cv::Vec3b colour(shade(colours[i][2]), shade(colours[i][1]), shade(colours[i][0]));
        for (int y = std::max(0, v - kReach); y <= std::min(picture.rows - 1, v + kReach); ++y) {
            for (int x = std::max(0, u - kReach); x <= std::min(picture.cols - 1, u + kReach);
                 ++x) {
                if (p.z() < depth.at<float>(y, x)) {
                    depth.at<float>(y, x) = p.z();
                    picture.at<cv::Vec3b>(y, x) = colour;
                }
            }
        }
    }
    const auto pixel = [&](const Eigen::Vector3d& x) {
        const Eigen::Vector3f p = project(x.cast<float>());
        return cv::Point(static_cast<int>(std::lround(p.x())),
                         static_cast<int>(std::lround(p.y())));
    };
    const double look = 0.05 * static_cast<double>((max - min).norm());
    for (std::size_t i = 0; i < taken.size(); ++i) {
        const cv::Point here = pixel(taken[i].translation);
        if (i > 0) {
            cv::line(picture, pixel(taken[i - 1].translation), here, {60, 200, 255}, 3,
                     cv::LINE_AA);
        }
        cv::line(picture, here, pixel(taken[i].translation + look * taken[i].rotation.col(2)),
                 {90, 110, 255}, 2, cv::LINE_AA);
        cv::circle(picture, here, 5, {60, 230, 255}, cv::FILLED, cv::LINE_AA);
    }
    cv::resize(picture, picture, {width, height}, 0, 0, cv::INTER_AREA);
    return picture;
}

}  // namespace riftmap
