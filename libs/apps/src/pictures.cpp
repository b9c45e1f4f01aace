// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/pictures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "painter.h"
#include "riftmap/core/file.h"
#include "riftmap/maps/graph_scene.h"

namespace riftmap {
namespace {

const cv::Scalar kRed(40, 30, 220);
const cv::Scalar kBlue(220, 110, 30);
const cv::Scalar kGreen(60, 170, 20);
const cv::Scalar kDarkGreen(30, 110, 0);

double medianOf(std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// A sample of the vertices without the outermost tenth: what a picture should show.
struct Extent {
    std::vector<Eigen::Vector3d> points;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double radius = 1;  ///< all points lie within it [m]
};

Extent extentOf(const PixelGraph& graph) {
    constexpr std::size_t kSamples = 50000;
    const std::size_t step = std::max<std::size_t>(1, graph.vertexCount() / kSamples);
    Extent extent;
    auto& sample = extent.points;
    std::size_t i = 0;
    graph.forEachVertex([&](VertexId id) {
        if (i++ % step == 0) {
            sample.push_back(graph.position(id).cast<double>());
        }
    });
    if (sample.empty()) {
        return extent;
    }
    std::vector<double> values(sample.size());
    for (int axis = 0; axis < 3; ++axis) {
        std::transform(sample.begin(), sample.end(), values.begin(),
                       [axis](const Eigen::Vector3d& p) { return p[axis]; });
        extent.centre[axis] = medianOf(values);
    }
    const auto nearer = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        return (a - extent.centre).squaredNorm() < (b - extent.centre).squaredNorm();
    };
    constexpr double kShare = 0.9;
    const auto last = std::lround(kShare * static_cast<double>(sample.size() - 1));
    std::nth_element(sample.begin(), sample.begin() + last, sample.end(), nearer);
    sample.resize(static_cast<std::size_t>(last) + 1);
    extent.radius = std::max(1e-3, (sample.back() - extent.centre).norm());
    return extent;
}

/// Unit mean of one axis of the cameras, or `fallback`.
Eigen::Vector3d meanAxis(const std::vector<Pose>& poses, int axis, double sign,
                         const Eigen::Vector3d& fallback) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& pose : poses) {
        sum += sign * pose.rotation.col(axis);
    }
    return sum.norm() > 1e-3 ? Eigen::Vector3d(sum.normalized()) : fallback;
}

/// From behind the cameras, raised and to their right, so near that map and cameras just fit.
/// `halfWidth`, `halfHeight`: of the picture at depth 1.
Pose overview(const Extent& extent, const MapPictureParts& parts, double halfWidth,
              double halfHeight) {
    const Eigen::Vector3d up = meanAxis(parts.taken, 1, -1.0, Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d ahead = meanAxis(parts.taken, 2, 1.0, Eigen::Vector3d::UnitX());
    const Eigen::Vector3d right = ahead.cross(up).normalized();
    const Eigen::Vector3d back = (-1.0 * ahead + 0.55 * up + 0.45 * right).normalized();

    auto points = extent.points;
    for (const auto* poses : {&parts.taken, &parts.planned}) {
        for (const auto& pose : *poses) {
            points.push_back(pose.translation);
        }
    }
    Eigen::Vector3d target = extent.centre;
    double distance = 3 * extent.radius;
    Pose view = lookAt(target + distance * back, target, up);
    constexpr int kRounds = 12;
    for (int round = 0; round < kRounds; ++round) {
        const Pose view_T_world = view.inverse();
        Eigen::AlignedBox2d box;
        bool behind = false;
        for (const auto& p : points) {
            const Eigen::Vector3d q = view_T_world * p;
            behind = behind || q.z() < 0.1 * distance;
            box.extend(Eigen::Vector2d(q.x(), q.y()) / std::max(q.z(), 0.1 * distance));
        }
        const Eigen::Vector2d middle = box.center() * distance;
        target += view.rotation * Eigen::Vector3d(middle.x(), middle.y(), 0);
        constexpr double kFill = 0.86;
        const double filled =
            std::max(0.5 * box.sizes().x() / halfWidth, 0.5 * box.sizes().y() / halfHeight);
        distance *= behind ? 1.3 : std::clamp(filled / kFill, 0.7, 1.4);
        view = lookAt(target + distance * back, target, up);
    }
    return view;
}

cv::Scalar bgr(const Vertex& v) {
    return {static_cast<double>(v.rgb[2]), static_cast<double>(v.rgb[1]),
            static_cast<double>(v.rgb[0])};
}

/// A vertex as a point, and with each two of its neighbours across low edges as a triangle: the
/// surface looks closed where it is. Each pixel quad is drawn from its first and its last corner.
void drawSurface(Painter& painter, const PixelGraph& graph, const std::vector<VertexId>& red) {
    struct Neighbour {
        Eigen::Vector3d position;
        float weight;
    };
    std::vector<Neighbour> before;
    std::vector<Neighbour> after;
    const auto drawFan = [&](const Eigen::Vector3d& at, const std::vector<Neighbour>& fan,
                             const cv::Scalar& colour) {
        for (std::size_t i = 0; i < fan.size(); ++i) {
            for (std::size_t k = i + 1; k < fan.size(); ++k) {
                const auto [shorter, longer] = std::minmax(fan[i].weight, fan[k].weight);
                constexpr float kSlant = 14;  // more is noise along the line of sight
                if (longer < kSlant * shorter) {
                    painter.triangle(at, fan[i].position, fan[k].position, colour);
                }
            }
        }
    };
    graph.forEachVertex([&](VertexId id) {
        const Vertex v = graph.vertex(id);
        const Eigen::Vector3d at = v.position.cast<double>();
        const bool marked = std::binary_search(red.begin(), red.end(), id);
        const cv::Scalar colour = marked ? kRed : bgr(v);
        const double pixel = painter.metresPerPixel(at);
        painter.point(at, marked ? 2 * pixel : 0, colour);
        before.clear();
        after.clear();
        float longest = 0;
        graph.forEachEdge(id, [&](VertexId other, float weight, bool high) {
            if (!high) {
                auto& fan = other < id ? before : after;
                fan.push_back({graph.position(other).cast<double>(), weight});
                longest = std::max(longest, weight);
            }
        });
        if (static_cast<double>(longest) > 0.5 * pixel) {  // else the points alone cover it
            drawFan(at, before, colour);
            drawFan(at, after, colour);
        }
    });
}

/// Cameras of a long drive must not hide one another.
double cameraSize(const Extent& extent, const MapPictureParts& parts) {
    double driven = 0;
    for (std::size_t i = 1; i < parts.taken.size(); ++i) {
        driven += (parts.taken[i].translation - parts.taken[i - 1].translation).norm();
    }
    const double size = 0.09 * extent.radius;
    constexpr double kShown = 12;
    return driven > size ? std::min(size, 0.6 * driven / kShown) : size;
}

void drawCameras(Painter& painter, const MapPictureParts& parts, double size) {
    for (std::size_t i = 1; i < parts.taken.size(); ++i) {
        painter.overlayLine(parts.taken[i - 1].translation, parts.taken[i].translation, 1.5,
                            kDarkGreen);
    }
    // Not every camera of a long recording.
    const std::size_t step = std::max<std::size_t>(1, parts.taken.size() / 12);
    for (std::size_t i = 0; i < parts.taken.size(); i += step) {
        painter.overlayCamera(parts.taken[i], size, 1.2, kDarkGreen);
    }
    if (!parts.taken.empty() && !parts.planned.empty()) {
        painter.overlayLine(parts.taken.back().translation, parts.planned.front().translation, 3.0,
                            kGreen);
    }
    for (std::size_t i = 1; i < parts.planned.size(); ++i) {
        painter.overlayLine(parts.planned[i - 1].translation, parts.planned[i].translation, 3.0,
                            kGreen);
    }
    const std::size_t plannedStep = std::max<std::size_t>(1, parts.planned.size() / 6);
    for (std::size_t i = 0; i < parts.planned.size(); i += plannedStep) {
        painter.overlayCamera(parts.planned[i], 0.8 * size, 1.2, kGreen);
    }
    if (!parts.planned.empty()) {
        painter.overlayCamera(parts.planned.back(), size, 3.0, kGreen);
    }
}

/// Indices of the largest rifts, the dominant one last so that nothing covers it.
std::vector<std::size_t> riftsToDraw(const MapPictureParts& parts) {
    std::vector<std::size_t> order(parts.rifts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return parts.rifts[a].vertices.size() > parts.rifts[b].vertices.size();
    });
    order.resize(std::min(order.size(), parts.maxArrows));
    if (parts.dominant) {
        order.erase(std::remove(order.begin(), order.end(), *parts.dominant), order.end());
        order.push_back(*parts.dominant);
    }
    return order;
}

}  // namespace

cv::Mat disparityPicture(const DisparityImage& disparity) {
    std::vector<float> valid;
    std::copy_if(disparity.disparity.begin(), disparity.disparity.end(), std::back_inserter(valid),
                 [](float d) { return std::isfinite(d); });
    cv::Mat picture(disparity.height, disparity.width, CV_8UC3, cv::Scalar::all(255));
    if (valid.empty()) {
        return picture;
    }
    std::sort(valid.begin(), valid.end());
    const float low = valid[valid.size() / 100];
    const float range = std::max(1e-3F, valid[valid.size() - 1 - valid.size() / 100] - low);
    cv::Mat level(disparity.height, disparity.width, CV_8UC1, cv::Scalar::all(0));
    cv::Mat known(disparity.height, disparity.width, CV_8UC1, cv::Scalar::all(0));
    for (int r = 0; r < disparity.height; ++r) {
        for (int c = 0; c < disparity.width; ++c) {
            if (disparity.valid(c, r)) {
                level.at<uchar>(r, c) =
                    cv::saturate_cast<uchar>(255.0F * (disparity.at(c, r) - low) / range);
                known.at<uchar>(r, c) = 255;
            }
        }
    }
    cv::Mat coloured;
    cv::applyColorMap(level, coloured, cv::COLORMAP_VIRIDIS);
    coloured.copyTo(picture, known);
    return picture;
}

cv::Mat mapPicture(const PixelGraph& graph, const MapPictureParts& parts, int width, int height) {
    constexpr double kFocal = 1.1;  // of the width
    const Extent extent = extentOf(graph);
    const double half = 0.5 / kFocal;
    Painter painter(width, height, overview(extent, parts, half, half * height / width),
                    kFocal * width);
    std::vector<VertexId> red;
    if (parts.dominant) {
        red = parts.rifts[*parts.dominant].vertices;
    }
    drawSurface(painter, graph, red);
    const double arrow = 0.11 * extent.radius;
    const auto shown = riftsToDraw(parts);
    for (const auto i : shown) {
        const auto& rift = parts.rifts[i];
        const bool dominant = parts.dominant == i;
        const Eigen::Vector3d from = rift.centre.cast<double>();
        const Eigen::Vector3d along = rift.normal.cast<double>() * arrow * (dominant ? 2.0 : 1.0);
        painter.overlayArrow(from, from + along, dominant ? 4.0 : 2.0, dominant ? kRed : kBlue);
    }
    drawCameras(painter, parts, cameraSize(extent, parts));
    std::string text = std::to_string(graph.vertexCount()) + " vertices, " +
                       std::to_string(parts.rifts.size()) + " rifts";
    if (shown.size() < parts.rifts.size()) {
        text += " (arrows: the largest " + std::to_string(shown.size()) + ")";
    }
    text += parts.dominant ? "; red: dominant rift" : "";
    text += parts.planned.empty() ? "; green: cameras" : "; green: cameras and planned path";
    painter.caption(text);
    return painter.result();
}

cv::Mat graphDetailPicture(const PixelGraph& graph, const Eigen::Vector3d& centre, double radius,
                           const Pose& world_T_camera, int width, int height) {
    // A little to the right of and above the camera that saw it.
    const Eigen::Vector3d sight = centre - world_T_camera.translation;
    const Eigen::Vector3d down = world_T_camera.rotation.col(1);
    constexpr double kTurn = 30.0 * std::numbers::pi / 180.0;
    constexpr double kRaise = 15.0 * std::numbers::pi / 180.0;
    const Eigen::Vector3d turned =
        Eigen::AngleAxisd(kTurn, down) *
        (Eigen::AngleAxisd(-kRaise, world_T_camera.rotation.col(0)) * sight.normalized());
    const double distance = 4.0 * radius;
    const double focal = 0.5 * width * distance / radius;
    Painter painter(width, height, lookAt(centre - distance * turned, centre, -down), focal);

    const Eigen::Vector3f half = Eigen::Vector3f::Constant(static_cast<float>(2.0 * radius));
    const Eigen::Vector3f middle = centre.cast<float>();
    std::vector<VertexId> near;
    graph.forEachVertexIn(middle - half, middle + half, [&](VertexId id) { near.push_back(id); });
    std::sort(near.begin(), near.end());
    std::vector<double> weights;
    for (const auto id : near) {
        graph.forEachEdge(id, [&](VertexId, float weight, bool isHigh) {
            if (!isHigh) {
                weights.push_back(static_cast<double>(weight));
            }
        });
    }
    const float high = weights.empty() ? 1.0F : static_cast<float>(4.0 * medianOf(weights));
    for (const auto id : near) {
        const Vertex v = graph.vertex(id);
        const double spot = 3.2 * painter.metresPerPixel(v.position.cast<double>());
        painter.point(v.position.cast<double>(), spot, bgr(v));
        graph.forEachEdge(id, [&](VertexId other, float weight, bool isHigh) {
            if (id < other || !std::binary_search(near.begin(), near.end(), other)) {
                const auto c = isHigh ? EdgeColour{1, 0, 0} : edgeColour(weight, high);
                const cv::Scalar colour(0, 0.78 * 255 * static_cast<double>(c.green),
                                        0.9 * 255 * static_cast<double>(c.red));
                painter.line(v.position.cast<double>(), graph.position(other).cast<double>(), 1.0,
                             colour, 0.02 * radius);
            }
        });
    }
    painter.caption("graph detail, " + std::to_string(std::lround(200.0 * radius)) +
                    " cm wide; edges green (low) to red (high)");
    return painter.result();
}

void writePicture(const std::filesystem::path& file, const cv::Mat& picture) {
    writeBesideAndRename(file, [&](const std::filesystem::path& part) {
        if (!cv::imwrite(part.string(), picture)) {
            throw FileError(file.string() + ": cannot be written");
        }
    });
}

}  // namespace riftmap
