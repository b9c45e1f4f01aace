// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/pictures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "riftmap/core/file.h"
#include "riftmap/core/parallel.h"

namespace riftmap {

namespace {

constexpr double kFocal = 1.4;     // in image widths: a field of view of 39 degrees
constexpr int kMostSurfaces = 64;  // that a ray passes before it gives up
constexpr double kDegree = 0.017453292519943295;

const cv::Vec3b kBackground(255, 255, 255);
const cv::Vec3d kCovered(95, 170, 85);
const cv::Vec3d kUncovered(40, 45, 225);
const cv::Vec3d kUnobservable(190, 165, 150);
const cv::Vec3d kFaint(225, 225, 225);

/// Colour and words for each VoxelOwner but kBoth and kNeither.
struct OwnerStyle {
    VoxelOwner owner;
    cv::Vec3d colour;
    const char* text;
};
const OwnerStyle kOwnerStyles[] = {
    {VoxelOwner::kOctomapClipped, {230, 190, 120}, "only OctoMap's: the surface clips a corner"},
    {VoxelOwner::kOctomapBeside, {210, 120, 40}, "only OctoMap's: ours runs beside it"},
    {VoxelOwner::kOctomapMissed, {130, 20, 120}, "only OctoMap's: we have nothing near"},
    {VoxelOwner::kOursCarved, {40, 150, 245}, "only ours: OctoMap's rays carved it"},
    {VoxelOwner::kOursUnknown, {30, 200, 250}, "only ours: no ray of OctoMap's was there"},
};

cv::Vec3b shaded(const cv::Vec3d& colour, double shade) {
    const cv::Vec3d c = colour * (0.45 + 0.55 * shade);
    return {cv::saturate_cast<uchar>(c[0]), cv::saturate_cast<uchar>(c[1]),
            cv::saturate_cast<uchar>(c[2])};
}

/// Blue, green, yellow, red at 0, 1, 2, 3 deltas.
cv::Vec3d heat(double deltas) {
    static const cv::Vec3d stops[] = {{200, 80, 40}, {80, 180, 60}, {40, 210, 240}, {40, 40, 220}};
    const double t = std::clamp(deltas, 0.0, 3.0);
    const int i = std::min(2, static_cast<int>(t));
    return stops[i] * (1 - (t - i)) + stops[i + 1] * (t - i);
}

/// In a band of its own above the picture.
void legend(cv::Mat& picture, const std::vector<std::pair<cv::Vec3d, std::string>>& entries) {
    cv::copyMakeBorder(picture, picture, 22 * static_cast<int>(entries.size()) + 12, 0, 0, 0,
                       cv::BORDER_CONSTANT, cv::Scalar(255, 255, 255));
    int y = 8;
    for (const auto& [colour, text] : entries) {
        cv::rectangle(picture, cv::Rect(12, y, 22, 14), cv::Scalar(colour[0], colour[1], colour[2]),
                      cv::FILLED);
        cv::putText(picture, text, {42, y + 12}, cv::FONT_HERSHEY_SIMPLEX, 0.48, {40, 40, 40}, 1,
                    cv::LINE_AA);
        y += 22;
    }
}

std::string percent(double share) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2f %%", 100 * share);
    return text;
}

std::string metres(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%g mm", 1000 * x);
    return text;
}

void writePng(const std::filesystem::path& file, const cv::Mat& picture) {
    writeBesideAndRename(file, [&](const std::filesystem::path& beside) {
        if (!cv::imwrite(beside.string(), picture)) {
            throw FileError(file.string() + ": cannot be written");
        }
    });
}

}  // namespace

CoveragePictures::CoveragePictures(const CoverageJudge& judge, const TriangleMesh& mesh,
                                   const RayCaster& caster,
                                   std::span<const Eigen::Vector3f> vertices,
                                   std::span<const Eigen::Vector3f> normals)
    : judge_(judge), caster_(caster), vertices_(vertices), normals_(normals) {
    const WorldKind kind = worldKind(mesh, judge.options().kind);
    building_ = kind == WorldKind::kIndoor;
    const double spacing =
        std::sqrt(judge.meshArea() / static_cast<double>(judge.samples().points.size()));
    reach_ = static_cast<float>(4 * spacing);
    samples_ = PointIndex(judge.samples().points, static_cast<float>(2 * spacing));
    map_ = PointIndex(vertices, static_cast<float>(judge.headline()));
    const Bounds box = bounds(mesh);
    const bool object = kind == WorldKind::kObject;
    const double last = object ? -40 : 89.9;
    for (const auto& [azimuth, elevation] : std::vector<std::pair<double, double>>{
             {-125, object ? 20 : 48}, {55, object ? 20 : 48}, {-90, last}}) {
        const double a = azimuth * kDegree;
        const double e = elevation * kDegree;
        const Eigen::Vector3d out(std::cos(a) * std::cos(e), std::sin(a) * std::cos(e),
                                  std::sin(e));
        // Far enough for all corners of the box to be in the picture (4:3).
        for (double distance = 0.4 * box.size().norm();; distance *= 1.02) {
            const Eye eye{lookAt(box.centre() + distance * out, box.centre()), kFocal};
            bool fits = true;
            for (int i = 0; i < 8; ++i) {
                const Eigen::Vector3d corner((i & 1) != 0 ? box.max.x() : box.min.x(),
                                             (i & 2) != 0 ? box.max.y() : box.min.y(),
                                             (i & 4) != 0 ? box.max.z() : box.min.z());
                const Eigen::Vector3d q = eye.pose.inverse() * corner;
                fits = fits && q.z() > 0.01 && std::abs(q.x()) * kFocal < 0.48 * q.z() &&
                       std::abs(q.y()) * kFocal < 0.36 * q.z();
            }
            if (fits) {
                eyes_.push_back(eye);
                break;
            }
        }
    }
}

std::optional<std::uint32_t> CoveragePictures::sampleOf(const Eigen::Vector3f& point,
                                                        const Eigen::Vector3f& normal) const {
    std::optional<std::uint32_t> best;
    float least = reach_ * reach_;
    samples_.anyWithin(point, reach_, [&](std::uint32_t i, float d2) {
        // Not one of the other side of a thin board.
        if (d2 <= least && judge_.samples().normals[i].dot(normal) > 0.5F) {
            least = d2;
            best = i;
        }
        return false;
    });
    return best;
}

CoveragePictures::Seen CoveragePictures::look(const Eye& eye, double column, double row, int width,
                                              int height) const {
    const double f = eye.focal * width;
    const Eigen::Vector3d inCamera((column - 0.5 * (width - 1)) / f, (row - 0.5 * (height - 1)) / f,
                                   1);
    const Eigen::Vector3d direction = eye.pose.rotation * inCamera;
    Eigen::Vector3d origin = eye.pose.translation;
    double depth = 0;
    bool entered = !building_;  // a building's outer skin is left out
    for (int i = 0; i < kMostSurfaces; ++i) {
        const auto hit = caster_.cast(origin, direction);
        if (!hit) {
            break;
        }
        depth += hit->t;
        const Eigen::Vector3d point = origin + hit->t * direction;
        Eigen::Vector3d normal = hit->normal;
        const auto sample = sampleOf(point.cast<float>(), normal.cast<float>());
        const bool observable = sample && judge_.observable().observable[*sample] != 0;
        if (observable && normal.dot(judge_.observable().normals[*sample].cast<double>()) < 0) {
            normal = -normal;  // the surface is seen from behind its triangles
        }
        const double facing = -normal.dot(direction) / direction.norm();
        entered = entered || observable;
        if (entered && facing > 0) {
            return {point, facing, depth, observable};
        }
        const double skip = 1e-4 * std::max(1.0, depth) * 0.1;
        origin = point + skip * direction;
        depth += skip;
    }
    return {};
}

template <class Colour>
cv::Mat CoveragePictures::paint(const Eye& eye, int width, int height, cv::Mat* depth,
                                Colour&& colour) const {
    cv::Mat picture(height, width, CV_8UC3);
    if (depth != nullptr) {
        *depth = cv::Mat(height, width, CV_32F, cv::Scalar(1e30F));
    }
    parallelForEach(height, 4, [&](int row) {
        for (int column = 0; column < width; ++column) {
            const Seen seen = look(eye, column, row, width, height);
            picture.at<cv::Vec3b>(row, column) = seen.depth > 0 ? colour(seen) : kBackground;
            if (depth != nullptr && seen.depth > 0) {
                depth->at<float>(row, column) = static_cast<float>(seen.depth);
            }
        }
    });
    return picture;
}

cv::Mat CoveragePictures::coverage(std::size_t viewpoint, int width, int height) const {
    const auto delta = static_cast<float>(judge_.headline());
    cv::Mat picture = paint(eyes_.at(viewpoint), width, height, nullptr, [&](const Seen& seen) {
        const bool covered = map_.nearest(seen.point.cast<float>(), delta).has_value();
        return shaded(covered           ? kCovered
                      : seen.observable ? kUncovered
                                        : kUnobservable,
                      seen.shade);
    });
    double cObs = 0;
    for (const Coverage& c : judge_.coverage(vertices_)) {
        if (std::abs(c.delta - judge_.headline()) < 1e-9) {
            cObs = c.cObs;
        }
    }
    legend(picture, {{kCovered, "covered within " + metres(judge_.headline()) + " (" +
                                    percent(cObs) + " of the observable)"},
                     {kUncovered, "observable, not covered"},
                     {kUnobservable, "not observable, not covered"}});
    return picture;
}

cv::Mat CoveragePictures::errors(std::size_t viewpoint, std::span<const float> vertexErrors,
                                 int width, int height) const {
    const Eye& eye = eyes_.at(viewpoint);
    cv::Mat depth;
    cv::Mat picture = paint(eye, width, height, &depth,
                            [](const Seen& seen) { return shaded(kFaint, seen.shade); });
    const double f = eye.focal * width;
    const Pose camera_T_world = eye.pose.inverse();
    const double delta = judge_.headline();
    depth += static_cast<float>(3 * delta);  // vertices just behind the surface show as well
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
        if (!vertices_[i].allFinite()) {
            continue;
        }
        const Eigen::Vector3d p = vertices_[i].cast<double>();
        double facing = 1;
        if (!normals_.empty() && normals_[i].squaredNorm() > 0.5F) {
            facing = normals_[i].cast<double>().dot((eye.pose.translation - p).normalized());
            if (facing < 0) {
                continue;  // turned away, like the surfaces left out
            }
        }
        const Eigen::Vector3d q = camera_T_world * p;
        if (q.z() <= 0) {
            continue;
        }
        const int column = static_cast<int>(std::lround(f * q.x() / q.z() + 0.5 * (width - 1)));
        const int row = static_cast<int>(std::lround(f * q.y() / q.z() + 0.5 * (height - 1)));
        const int half = std::clamp(static_cast<int>(0.5 * delta * f / q.z()), 0, 2);
        const auto z = static_cast<float>(q.z());
        const cv::Vec3d colour = heat(static_cast<double>(vertexErrors[i]) / delta);
        for (int r = std::max(0, row - half); r <= std::min(height - 1, row + half); ++r) {
            for (int c = std::max(0, column - half); c <= std::min(width - 1, column + half); ++c) {
                if (z < depth.at<float>(r, c)) {
                    depth.at<float>(r, c) = z;
                    picture.at<cv::Vec3b>(r, c) = shaded(colour, facing);
                }
            }
        }
    }
    legend(picture, {{heat(0), "vertex on the surface"},
                     {heat(1), metres(delta) + " off"},
                     {heat(2), metres(2 * delta)},
                     {heat(3), metres(3 * delta) + " and more"},
                     {kFaint, "the world, no vertex"}});
    return picture;
}

cv::Mat CoveragePictures::owners(std::size_t viewpoint, const VoxelOwners& ownerOf, int width,
                                 int height) const {
    cv::Mat picture = paint(eyes_.at(viewpoint), width, height, nullptr, [&](const Seen& seen) {
        if (!seen.observable) {
            return shaded(kUnobservable, seen.shade);
        }
        const VoxelOwner owner = ownerOf(seen.point.cast<float>());
        if (owner == VoxelOwner::kBoth) {
            return shaded(kFaint, seen.shade);
        }
        const auto* const style =
            std::find_if(std::begin(kOwnerStyles), std::end(kOwnerStyles),
                         [&](const OwnerStyle& s) { return s.owner == owner; });
        return shaded(style == std::end(kOwnerStyles) ? kUncovered : style->colour, seen.shade);
    });
    std::vector<std::pair<cv::Vec3d, std::string>> entries = {{kFaint, "voxel of both"}};
    for (const OwnerStyle& style : kOwnerStyles) {
        entries.emplace_back(style.colour, style.text);
    }
    entries.emplace_back(kUncovered, "of neither");
    entries.emplace_back(kUnobservable, "not observable");
    legend(picture, entries);
    return picture;
}

void CoveragePictures::writeOwners(const std::filesystem::path& directory,
                                   const VoxelOwners& ownerOf) const {
    for (std::size_t i = 0; i < viewpoints(); ++i) {
        writePng(directory / ("octomap_" + std::to_string(i) + ".png"), owners(i, ownerOf));
    }
}

void CoveragePictures::write(const std::filesystem::path& directory,
                             std::span<const float> vertexErrors) const {
    for (std::size_t i = 0; i < viewpoints(); ++i) {
        writePng(directory / ("coverage_" + std::to_string(i) + ".png"), coverage(i));
        writePng(directory / ("error_" + std::to_string(i) + ".png"), errors(i, vertexErrors));
    }
}

}  // namespace riftmap
