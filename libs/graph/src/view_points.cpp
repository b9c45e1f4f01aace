// SPDX-License-Identifier: BSD-3-Clause
#include "view_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "riftmap/core/parallel.h"

namespace riftmap {
namespace {

constexpr float kLargestStretch = 10.0F;  // beyond 84 degrees nothing is explained by the angle
constexpr float kNoiseFactor = 3.0F;      // what noise explains, in standard deviations
constexpr std::size_t kRowsAtOnce = 16;

template <class F>
void forEachRow(int rows, F&& f) {
    parallelFor(static_cast<std::size_t>(rows), kRowsAtOnce,
                [&f](std::size_t begin, std::size_t end) {
                    for (std::size_t r = begin; r != end; ++r) {
                        f(static_cast<int>(r));
                    }
                });
}

/// Least-squares plane d = a x + b y + e over pixels.
struct PlaneSums {
    float n = 0, x = 0, y = 0, d = 0, xx = 0, xy = 0, yy = 0, xd = 0, yd = 0;
    void add(float px, float py, float pd) {
        n += 1;
        x += px;
        y += py;
        d += pd;
        xx += px * px;
        xy += px * py;
        yy += py * py;
        xd += px * pd;
        yd += py * pd;
    }
    bool solve(float& a, float& b, float& e) const {
        const float vxx = xx - x * x / n, vxy = xy - x * y / n, vyy = yy - y * y / n;
        const float vxd = xd - x * d / n, vyd = yd - y * d / n;
        const float det = vxx * vyy - vxy * vxy;
        if (!(det > 1e-3F * n * n)) {
            return false;  // all in a line
        }
        a = (vxd * vyy - vyd * vxy) / det;
        b = (vyd * vxx - vxd * vxy) / det;
        e = (d - a * x - b * y) / n;
        return true;
    }
};

}  // namespace

void ViewPoints::build(const View& view, const GraphOptions& options) {
    const StereoCamera& k = view.camera;
    width = k.width;
    height = k.height;
    fx = static_cast<float>(k.fx);
    fy = static_cast<float>(k.fy);
    cx = static_cast<float>(k.cx);
    cy = static_cast<float>(k.cy);
    fb = static_cast<float>(k.fx * k.baseline);
    footprint = 1.0F / std::min(fx, fy);
    rotation = view.world_T_camera.rotation.cast<float>();
    translation = view.world_T_camera.translation.cast<float>();
    const auto n = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    z.resize(n);
    sigma.resize(n);
    disparity.resize(n);
    stretch.resize(n);
    area.resize(n);
    rayX_.resize(static_cast<std::size_t>(width));
    rayY_.resize(static_cast<std::size_t>(height));
    for (int c = 0; c < width; ++c) {
        rayX_[static_cast<std::size_t>(c)] = (static_cast<float>(c) - cx) / fx;
    }
    for (int r = 0; r < height; ++r) {
        rayY_[static_cast<std::size_t>(r)] = (static_cast<float>(r) - cy) / fy;
    }
    right.resize(n);
    down.resize(n);
    kinds.resize(n);
    patchColumns_ = (width + kPatch - 1) / kPatch;
    const int patchRows = (height + kPatch - 1) / kPatch;
    patches.resize(static_cast<std::size_t>(patchColumns_) * static_cast<std::size_t>(patchRows));

    forEachRow(height, [&](int r) { computeDepth(view, r); });
    forEachRow(patchRows, [&](int r) {
        for (int c = 0; c < patchColumns_; ++c) {
            fitPatch(view.disparity, c, r);
        }
    });
    forEachRow(height, [&](int r) { computeAngles(r); });
    forEachRow(height, [&](int r) { computeEdges(options, r); });
    forEachRow(height, [&](int r) { computeKinds(options, view.disparity.firstColumn, r); });
    validCount = static_cast<std::size_t>(
        std::count_if(z.begin(), z.end(), [](float depth) { return depth > 0; }));
}

void ViewPoints::computeDepth(const View& view, int row) {
    const float doffs = static_cast<float>(view.camera.doffs);
    for (int c = 0; c < width; ++c) {
        const std::size_t i = index(c, row);
        const float d = view.disparity.disparity[i] + doffs;
        const float sd = view.disparity.sigma[i];
        const float depth = fb / d;
        const float s = depth * depth * sd / fb;
        // A depth that is not known within a third of itself is no point of the surface.
        const bool ok = std::isfinite(d) && d > 0 && s >= 0 && kNoiseFactor * s < depth;
        z[i] = ok ? depth : 0.0F;
        sigma[i] = ok ? s : 0.0F;
        disparity[i] = d;
    }
}

void ViewPoints::computeAngles(int row) {
    const float y = rayY_[static_cast<std::size_t>(row)];
    for (int c = 0; c < width; ++c) {
        const std::size_t i = index(c, row);
        const float x = rayX_[static_cast<std::size_t>(c)];
        const float ray = std::sqrt(x * x + y * y + 1.0F);
        float angle = 0.0F;
        if (z[i] > 0) {
            // cos = |n . ray| / |ray| and z = distance / (n . ray)
            angle = onPatch(c, row) ? patch(c, row).inverseDistance * z[i] * ray
                                    : angleFromNeighbours(c, row);
            angle = angle > 0 ? std::clamp(angle, 1.0F, kLargestStretch) : 0.0F;
        }
        stretch[i] = angle;
        // z^2 / (fx fy |n . ray|), where 1 / |n . ray| = stretch / |ray|
        area[i] = z[i] * z[i] * std::max(1.0F, angle) / (fx * fy * ray);
    }
}

/// From the patch beside, where the pixel lies on its plane.
float ViewPoints::angleFromPatches(int column, int row) const {
    const std::size_t i = index(column, row);
    for (const auto& [dc, dr] : {std::pair{-kPatch, 0}, {kPatch, 0}, {0, -kPatch}, {0, kPatch}}) {
        const int c = column + dc, r = row + dr;
        if (c < 0 || r < 0 || c >= width || r >= height) {
            continue;
        }
        const PatchPlane& p = patch(c, r);
        if (std::abs(disparity[i] - p.disparity(column, row)) <= p.tolerance) {
            return p.inverseDistance * z[i] * inCamera(column, row, 1.0F).norm();
        }
    }
    return 0.0F;
}

void ViewPoints::fitPatch(const DisparityImage& image, int patchColumn, int patchRow) {
    PatchPlane& plane =
        patches[static_cast<std::size_t>(patchRow) * static_cast<std::size_t>(patchColumns_) +
                static_cast<std::size_t>(patchColumn)];
    plane = PatchPlane{};
    plane.column = std::min(patchColumn * kPatch + kPatch / 2, width - 1);
    plane.row = std::min(patchRow * kPatch + kPatch / 2, height - 1);
    const std::size_t centre = index(plane.column, plane.row);
    if (!(z[centre] > 0)) {
        return;
    }
    const float d0 = disparity[centre];
    const float sd = image.sigma[centre];
    // Where noise hides the slope between neighbours, look farther.
    const bool noisy = sigma[centre] > 0.25F * z[centre] * footprint;
    const int radius = noisy ? 6 : 2, step = noisy ? 3 : 1;
    const float steepest = kLargestStretch * fb / (fx * z[centre]);
    const int dcFirst = std::max(-radius, -plane.column / step * step);
    const int dcLast = std::min(radius, width - 1 - plane.column);
    const int drFirst = std::max(-radius, -plane.row / step * step);
    const int drLast = std::min(radius, height - 1 - plane.row);
    const auto collect = [&](auto&& expected, float tolerance) {
        PlaneSums sums;
        for (int dr = drFirst; dr <= drLast; dr += step) {
            const std::size_t i = index(plane.column, plane.row + dr);
            for (int dc = dcFirst; dc <= dcLast; dc += step) {
                const std::size_t j = i + static_cast<std::size_t>(dc);
                const auto x = static_cast<float>(dc), y = static_cast<float>(dr);
                const float d = disparity[j] - d0;
                if (z[j] > 0 && std::abs(d - expected(x, y)) <= tolerance) {
                    sums.add(x, y, d);
                }
            }
        }
        return sums;
    };
    const float least = 9;
    const float tolerance = 3.0F * sd + 0.05F;
    float a = 0, b0 = 0, e = 0;
    PlaneSums sums = collect([](float, float) { return 0.0F; },
                             4.0F * sd + steepest * static_cast<float>(radius));
    if (sums.n < least || !sums.solve(a, b0, e)) {
        return;
    }
    sums = collect([&](float x, float y) { return e + a * x + b0 * y; }, tolerance);
    if (sums.n < least || !sums.solve(a, b0, e)) {
        return;
    }
    plane.slopeColumn = a;
    plane.slopeRow = b0;
    plane.value = d0 + e;
    // n / distance of the plane n . X = distance, from disparity = fb (n . ray) / distance.
    const float b = fb / fx;
    const Eigen::Vector3f scaled(
        plane.slopeColumn / b, plane.slopeRow * fy / fb,
        (plane.value + (cx - static_cast<float>(plane.column)) * plane.slopeColumn +
         (cy - static_cast<float>(plane.row)) * plane.slopeRow) /
            fb);
    plane.inverseDistance = scaled.norm();
    plane.normal = -scaled / plane.inverseDistance;
    plane.tolerance = tolerance;
}

/// From the pixels beside, where noise permits. 0 = unknown.
float ViewPoints::angleFromNeighbours(int column, int row) const {
    const std::size_t i = index(column, row);
    if (sigma[i] > 0.25F * z[i] * footprint || column < 1 || row < 1 || column + 1 >= width ||
        row + 1 >= height) {
        return angleFromPatches(column, row);
    }
    // Of the two sides the one that lies nearer: the other may lie across a step.
    const auto difference = [&](int dc, int dr) -> Eigen::Vector3f {
        const float before = z[index(column - dc, row - dr)];
        const float after = z[index(column + dc, row + dr)];
        const Eigen::Vector3f here = inCamera(column, row, z[i]);
        if (after > 0 && (!(before > 0) || std::abs(after - z[i]) <= std::abs(before - z[i]))) {
            return inCamera(column + dc, row + dr, after) - here;
        }
        return before > 0 ? Eigen::Vector3f(here - inCamera(column - dc, row - dr, before))
                          : Eigen::Vector3f(Eigen::Vector3f::Zero());
    };
    const Eigen::Vector3f normal = difference(1, 0).cross(difference(0, 1));
    const Eigen::Vector3f ray = inCamera(column, row, 1.0F);
    const float across = std::abs(normal.dot(ray));
    return across > 0 ? normal.norm() * ray.norm() / across : 0.0F;
}

bool ViewPoints::explained(int c, int r, int c2, int r2, float tolerance) const {
    const PatchPlane& p = patch(c, r);
    const float d = p.disparity(c2, r2);
    return stretch[index(c, r)] > 1.0F && stretch[index(c, r)] < kLargestStretch && d > 0 &&
           std::abs(fb / d - z[index(c2, r2)]) <= tolerance && onPatch(c, r);
}

bool ViewPoints::isHigh(const GraphOptions& options, float squared, int c, int r, int c2,
                        int r2) const {
    if (options.delta > 0) {
        return squared > static_cast<float>(options.delta * options.delta);
    }
    const std::size_t i = index(c, r), j = index(c2, r2);
    const auto target = static_cast<float>(options.targetResolution);
    const float spacing = footprint * std::max(z[i], z[j]);
    if (squared <= (target + spacing) * (target + spacing)) {
        return false;
    }
    const float noise = kNoiseFactor * std::sqrt(sigma[i] * sigma[i] + sigma[j] * sigma[j]);
    const float tolerance = target + noise;
    return squared > (tolerance + spacing) * (tolerance + spacing) &&
           !explained(c, r, c2, r2, tolerance) && !explained(c2, r2, c, r, tolerance);
}

void ViewPoints::computeEdges(const GraphOptions& options, int row) {
    const float y = rayY_[static_cast<std::size_t>(row)];
    const float y2 = row + 1 < height ? rayY_[static_cast<std::size_t>(row) + 1] : y;
    const auto code = [&](int c, int c2, int r2, float ya) -> std::uint16_t {
        if (c2 >= width || r2 >= height) {
            return kNoEdge;
        }
        const std::size_t i = index(c, row), j = index(c2, r2);
        if (!(z[i] > 0) || !(z[j] > 0)) {
            return kNoEdge;
        }
        const float dx =
            rayX_[static_cast<std::size_t>(c2)] * z[j] - rayX_[static_cast<std::size_t>(c)] * z[i];
        const float dy = ya * z[j] - y * z[i], dz = z[j] - z[i];
        const float squared = dx * dx + dy * dy + dz * dz;
        const std::uint16_t weight =  // eq. (3)
            std::min<std::uint16_t>(compact::Weight::encode(std::sqrt(squared)), 0x7FFE);
        return static_cast<std::uint16_t>(
            weight | (isHigh(options, squared, c, row, c2, r2) ? compact::kHighBit : 0));
    };
    for (int c = 0; c < width; ++c) {
        right[index(c, row)] = code(c, c + 1, row, y);
        down[index(c, row)] = code(c, c, row + 1, y2);
    }
}

void ViewPoints::computeKinds(const GraphOptions& options, int firstColumn, int row) {
    for (int c = 0; c < width; ++c) {
        const std::size_t i = index(c, row);
        unsigned bits = 0;
        const auto look = [&](int c2, int r2, std::uint16_t code) {
            if (c2 < 0 || r2 < 0 || c2 >= width || r2 >= height) {
                bits |= kImageBorder;
            } else if (code == kNoEdge) {
                bits |= c2 < firstColumn ? kImageBorder : kNoMatch;
            } else if ((code & compact::kHighBit) != 0) {
                bits |= kDepthStep;
            }
        };
        if (z[i] > 0) {
            look(c + 1, row, right[i]);
            look(c, row + 1, down[i]);
            look(c - 1, row, c > 0 ? right[i - 1] : kNoEdge);
            look(c, row - 1, row > 0 ? down[i - static_cast<std::size_t>(width)] : kNoEdge);
        }
        kinds[i] = static_cast<std::uint8_t>(options.typedOpenness ? bits : bits & kDepthStep);
    }
}

}  // namespace riftmap
