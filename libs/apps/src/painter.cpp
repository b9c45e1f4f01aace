// SPDX-License-Identifier: BSD-3-Clause
#include "painter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace riftmap {
namespace {

constexpr int kScale = 2;       ///< canvas pixels per pixel of the result
constexpr double kNear = 0.01;  ///< nothing nearer is drawn [m]
constexpr int kShift = 4;       ///< fractional bits of OpenCV's line ends

cv::Point fixedPoint(const Eigen::Vector3d& p) {
    constexpr double kLimit = 1e5;  // well inside OpenCV's integers
    return {static_cast<int>(std::lround(std::clamp(p.x(), -kLimit, kLimit) * (1 << kShift))),
            static_cast<int>(std::lround(std::clamp(p.y(), -kLimit, kLimit) * (1 << kShift)))};
}

cv::Vec3b toBytes(const cv::Scalar& colour) {
    return {cv::saturate_cast<uchar>(colour[0]), cv::saturate_cast<uchar>(colour[1]),
            cv::saturate_cast<uchar>(colour[2])};
}

int strokeWidth(double thickness) {
    return std::max(1, static_cast<int>(std::lround(thickness * kScale)));
}

}  // namespace

Painter::Painter(int width, int height, const Pose& world_T_view, double focal)
    : view_T_world_(world_T_view.inverse()),
      focal_(focal * kScale),
      canvas_(height * kScale, width * kScale, CV_8UC3, cv::Scalar::all(255)),
      depth_(height * kScale, width * kScale, CV_32FC1,
             cv::Scalar::all(std::numeric_limits<float>::infinity())) {}

Eigen::Vector3d Painter::project(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = view_T_world_ * p;
    return {focal_ * q.x() / q.z() + 0.5 * canvas_.cols,
            focal_ * q.y() / q.z() + 0.5 * canvas_.rows, q.z()};
}

double Painter::metresPerPixel(const Eigen::Vector3d& p) const {
    return (view_T_world_ * p).z() * kScale / focal_;
}

void Painter::point(const Eigen::Vector3d& p, double size, const cv::Scalar& colour) {
    const Eigen::Vector3d q = project(p);
    if (!(q.z() > kNear)) {
        return;
    }
    constexpr double kMaxHalf = 24;
    const double half = std::clamp(0.5 * size * focal_ / q.z(), 0.5, kMaxHalf);
    const int x0 = std::max(0, static_cast<int>(std::lround(q.x() - half)));
    const int y0 = std::max(0, static_cast<int>(std::lround(q.y() - half)));
    const int x1 = std::min(canvas_.cols, static_cast<int>(std::lround(q.x() + half)));
    const int y1 = std::min(canvas_.rows, static_cast<int>(std::lround(q.y() + half)));
    const cv::Vec3b bgr = toBytes(colour);
    for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
            set(x, y, q.z(), bgr);
        }
    }
}

void Painter::set(int x, int y, double z, const cv::Vec3b& bgr) {
    auto& depth = depth_.at<float>(y, x);
    if (z < static_cast<double>(depth)) {
        depth = static_cast<float>(z);
        canvas_.at<cv::Vec3b>(y, x) = bgr;
    }
}

void Painter::triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const cv::Scalar& colour) {
    const std::array<Eigen::Vector3d, 3> p = {project(a), project(b), project(c)};
    if (!(p[0].z() > kNear) || !(p[1].z() > kNear) || !(p[2].z() > kNear)) {
        return;
    }
    const Eigen::Vector2d u = (p[1] - p[0]).head<2>();
    const Eigen::Vector2d v = (p[2] - p[0]).head<2>();
    const double area = u.x() * v.y() - u.y() * v.x();
    if (std::abs(area) < 1e-9) {
        return;
    }
    const auto [xMin, xMax] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
    const auto [yMin, yMax] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    if (xMax < 0 || yMax < 0 || xMin > canvas_.cols || yMin > canvas_.rows) {
        return;
    }
    const int x1 = std::min(canvas_.cols - 1, static_cast<int>(std::ceil(xMax)));
    const int y1 = std::min(canvas_.rows - 1, static_cast<int>(std::ceil(yMax)));
    const cv::Vec3b bgr = toBytes(colour);
    for (int y = std::max(0, static_cast<int>(std::floor(yMin))); y <= y1; ++y) {
        for (int x = std::max(0, static_cast<int>(std::floor(xMin))); x <= x1; ++x) {
            const Eigen::Vector2d w(x - p[0].x(), y - p[0].y());
            const double s = (w.x() * v.y() - w.y() * v.x()) / area;
            const double t = (u.x() * w.y() - u.y() * w.x()) / area;
            if (s >= 0 && t >= 0 && s + t <= 1) {
                // Depth is linear in 1/z on the screen.
                set(x, y, 1.0 / ((1 - s - t) / p[0].z() + s / p[1].z() + t / p[2].z()), bgr);
            }
        }
    }
}

/// Cuts the part behind the viewer off (coordinates of the view); false if nothing is left.
bool Painter::clip(Eigen::Vector3d& a, Eigen::Vector3d& b) const {
    if (a.z() < kNear && b.z() < kNear) {
        return false;
    }
    if (a.z() < kNear) {
        a += (b - a) * ((kNear - a.z()) / (b.z() - a.z()));
    } else if (b.z() < kNear) {
        b += (a - b) * ((kNear - b.z()) / (a.z() - b.z()));
    }
    return true;
}

void Painter::line(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double thickness,
                   const cv::Scalar& colour, double slack) {
    const Eigen::Vector3d from = project(a);
    const Eigen::Vector3d to = project(b);
    if (!(from.z() > kNear) || !(to.z() > kNear)) {
        return;
    }
    const int steps =
        std::max(1, static_cast<int>(std::ceil((to - from).head<2>().cwiseAbs().maxCoeff())));
    constexpr int kMaxSteps = 20000;
    if (steps > kMaxSteps) {
        return;
    }
    const double half = 0.5 * thickness * kScale;
    const cv::Vec3b bgr = toBytes(colour);
    for (int i = 0; i <= steps; ++i) {
        const double s = static_cast<double>(i) / steps;
        const Eigen::Vector3d q = from + s * (to - from);
        // Depth is linear in 1/z along the line on the screen.
        const double z = 1.0 / ((1 - s) / from.z() + s / to.z());
        const int y1 = static_cast<int>(std::lround(q.y() + half));
        const int x1 = static_cast<int>(std::lround(q.x() + half));
        for (int y = static_cast<int>(std::lround(q.y() - half)); y < y1; ++y) {
            for (int x = static_cast<int>(std::lround(q.x() - half)); x < x1; ++x) {
                if (x >= 0 && y >= 0 && x < canvas_.cols && y < canvas_.rows &&
                    z - slack < static_cast<double>(depth_.at<float>(y, x))) {
                    canvas_.at<cv::Vec3b>(y, x) = bgr;
                    depth_.at<float>(y, x) =
                        std::min(depth_.at<float>(y, x), static_cast<float>(z));
                }
            }
        }
    }
}

void Painter::stroke(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double thickness,
                     const cv::Scalar& colour) {
    Eigen::Vector3d from = view_T_world_ * a;
    Eigen::Vector3d to = view_T_world_ * b;
    if (!clip(from, to)) {
        return;
    }
    const Pose back = view_T_world_.inverse();
    cv::line(canvas_, fixedPoint(project(back * from)), fixedPoint(project(back * to)), colour,
             strokeWidth(thickness), cv::LINE_AA, kShift);
}

void Painter::overlayLine(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double thickness,
                          const cv::Scalar& colour) {
    stroke(a, b, thickness + 1.5, cv::Scalar::all(255));
    stroke(a, b, thickness, colour);
}

void Painter::overlayArrow(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double thickness,
                           const cv::Scalar& colour) {
    const Eigen::Vector3d a = project(from);
    const Eigen::Vector3d b = project(to);
    if (!(a.z() > kNear) || !(b.z() > kNear)) {
        return;
    }
    const Eigen::Vector2d along = b.head<2>() - a.head<2>();
    const double length = along.norm();
    // Also an arrow that points at the viewer has a head.
    const Eigen::Vector2d unit =
        length > 1e-6 ? Eigen::Vector2d(along / length) : Eigen::Vector2d(0, -1);
    const Eigen::Vector2d side(-unit.y(), unit.x());
    const double head = 4.0 * thickness * kScale;
    const Eigen::Vector2d neck = b.head<2>() - unit * head;
    const auto corner = [](const Eigen::Vector2d& p) {
        return fixedPoint(Eigen::Vector3d(p.x(), p.y(), 1));
    };
    const std::vector<cv::Point> tip = {corner(b.head<2>()), corner(neck + 0.5 * head * side),
                                        corner(neck - 0.5 * head * side)};
    const double rim = 0.75 * kScale;
    if (length > head) {
        cv::line(canvas_, fixedPoint(a), corner(neck), cv::Scalar::all(255),
                 strokeWidth(thickness + 1.5), cv::LINE_AA, kShift);
    }
    cv::polylines(canvas_, std::vector<std::vector<cv::Point>>{tip}, true, cv::Scalar::all(255),
                  static_cast<int>(std::lround(2 * rim)), cv::LINE_AA, kShift);
    if (length > head) {
        cv::line(canvas_, fixedPoint(a), corner(neck), colour, strokeWidth(thickness), cv::LINE_AA,
                 kShift);
    }
    cv::fillConvexPoly(canvas_, tip, colour, cv::LINE_AA, kShift);
}

void Painter::overlayCamera(const Pose& world_T_camera, double size, double thickness,
                            const cv::Scalar& colour) {
    const double w = 0.5 * size;
    const double h = 0.36 * size;
    const std::vector<Eigen::Vector3d> corners = {world_T_camera * Eigen::Vector3d(-w, -h, size),
                                                  world_T_camera * Eigen::Vector3d(w, -h, size),
                                                  world_T_camera * Eigen::Vector3d(w, h, size),
                                                  world_T_camera * Eigen::Vector3d(-w, h, size)};
    const auto& apex = world_T_camera.translation;
    for (std::size_t i = 0; i < 4; ++i) {
        overlayLine(corners[i], corners[(i + 1) % 4], thickness, colour);
        overlayLine(apex, corners[i], thickness, colour);
    }
}

void Painter::caption(const std::string& text) {
    constexpr double kSize = 0.55 * kScale;
    const int strip = 30 * kScale;
    cv::Mat band = canvas_.rowRange(canvas_.rows - strip, canvas_.rows);
    band.convertTo(band, -1, 0.3, 20);
    cv::putText(canvas_, text, {12 * kScale, canvas_.rows - 9 * kScale}, cv::FONT_HERSHEY_SIMPLEX,
                kSize, cv::Scalar::all(255), kScale, cv::LINE_AA);
}

cv::Mat Painter::result() const {
    cv::Mat small;
    cv::resize(canvas_, small, {}, 1.0 / kScale, 1.0 / kScale, cv::INTER_AREA);
    return small;
}

}  // namespace riftmap
