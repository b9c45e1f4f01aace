// SPDX-License-Identifier: BSD-3-Clause
#include "view_points.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace riftmap {
namespace {

constexpr float kLargestStretch = 10.0F;  // beyond 84 degrees nothing is explained by the angle
constexpr float kNoiseFactor = 3.0F;      // what noise explains, in standard deviations
constexpr float kRowsAtOnce = 16;

template <class F>
void forEachRow(int rows, F&& f) {
    tbb::parallel_for(tbb::blocked_range<int>(0, rows, static_cast<int>(kRowsAtOnce)),
                      [&](const tbb::blocked_range<int>& range) {
                          for (int r = range.begin(); r != range.end(); ++r) {
                              f(r);
                          }
                      });
}

/// Least-squares plane over pixels (dc, dr, disparity).
struct PlaneSums {
    double n = 0, c = 0, r = 0, d = 0, cc = 0, cr = 0, rr = 0, cd = 0, rd = 0;
    void add(double dc, double dr, double disparity) {
        n += 1;
        c += dc;
        r += dr;
        d += disparity;
        cc += dc * dc;
        cr += dc * dr;
        rr += dr * dr;
        cd += dc * disparity;
        rd += dr * disparity;
    }
    bool solve(PatchPlane& plane) const {
        const double vcc = cc - c * c / n, vcr = cr - c * r / n, vrr = rr - r * r / n;
        const double vcd = cd - c * d / n, vrd = rd - r * d / n;
        const double det = vcc * vrr - vcr * vcr;
        if (!(det > 1e-3 * n * n)) {
            return false;  // all in a line
        }
        const double a = (vcd * vrr - vrd * vcr) / det, b = (vrd * vcc - vcd * vcr) / det;
        plane.slopeColumn = static_cast<float>(a);
        plane.slopeRow = static_cast<float>(b);
        plane.value = static_cast<float>((d - a * c - b * r) / n);
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
    stretch.resize(n);
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
    forEachRow(height, [&](int r) {
        for (int c = 0; c < width; ++c) {
            const PatchPlane& p = patch(c, r);
            const std::size_t i = index(c, r);
            stretch[i] = 1.0F;
            if (z[i] > 0 && onPatch(c, r)) {
                const Eigen::Vector3f ray = inCamera(c, r, 1.0F);
                // cos = |n . ray| / |ray| and z = distance / (n . ray)
                stretch[i] =
                    std::clamp(p.inverseDistance * z[i] * ray.norm(), 1.0F, kLargestStretch);
            }
        }
    });
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
    }
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
    const float d0 = fb / z[centre];
    const float sd = image.sigma[centre];
    // Where noise hides the slope between neighbours, look farther.
    const bool noisy = sigma[centre] > 0.25F * z[centre] * footprint;
    const int radius = noisy ? 6 : 2, step = noisy ? 2 : 1;
    const float steepest = kLargestStretch * fb / (fx * z[centre]);
    const auto collect = [&](auto&& keep) {
        PlaneSums sums;
        for (int dr = -radius; dr <= radius; dr += step) {
            for (int dc = -radius; dc <= radius; dc += step) {
                const int c = plane.column + dc, r = plane.row + dr;
                if (c < 0 || r < 0 || c >= width || r >= height || !(z[index(c, r)] > 0)) {
                    continue;
                }
                const float d = fb / z[index(c, r)];
                if (keep(c, r, d)) {
                    sums.add(dc, dr, static_cast<double>(d));
                }
            }
        }
        return sums;
    };
    const float gate = 4.0F * sd + steepest * static_cast<float>(radius);
    const double least = noisy ? 16 : 8;
    PlaneSums sums = collect([&](int, int, float d) { return std::abs(d - d0) <= gate; });
    if (sums.n < least || !sums.solve(plane)) {
        return;
    }
    const float tolerance = 3.0F * sd + 0.05F;
    sums = collect(
        [&](int c, int r, float d) { return std::abs(d - plane.disparity(c, r)) <= tolerance; });
    if (sums.n < least || !sums.solve(plane)) {
        return;
    }
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

bool ViewPoints::onPatch(int column, int row) const {
    const PatchPlane& p = patch(column, row);
    return std::abs(fb / z[index(column, row)] - p.disparity(column, row)) <= p.tolerance;
}

float ViewPoints::area(int column, int row) const {
    const std::size_t i = index(column, row);
    // z^2 / (fx fy |n . ray|), where 1 / |n . ray| = stretch / |ray|
    return z[i] * z[i] * stretch[i] / (fx * fy * inCamera(column, row, 1.0F).norm());
}

bool ViewPoints::explained(int c, int r, int c2, int r2, float tolerance) const {
    const PatchPlane& p = patch(c, r);
    const float d = p.disparity(c2, r2);
    return stretch[index(c, r)] > 1.0F && stretch[index(c, r)] < kLargestStretch && d > 0 &&
           std::abs(fb / d - z[index(c2, r2)]) <= tolerance && onPatch(c, r);
}

std::uint16_t ViewPoints::edge(const GraphOptions& options, int c, int r, int c2, int r2) const {
    const std::size_t i = index(c, r), j = index(c2, r2);
    if (!(z[i] > 0) || !(z[j] > 0)) {
        return kNoEdge;
    }
    const float weight = (inCamera(c, r, z[i]) - inCamera(c2, r2, z[j])).norm();  // eq. (3)
    bool high = false;
    if (options.delta > 0) {
        high = weight > static_cast<float>(options.delta);
    } else {
        const float noise = kNoiseFactor * std::sqrt(sigma[i] * sigma[i] + sigma[j] * sigma[j]);
        const float tolerance = static_cast<float>(options.targetResolution) + noise;
        const float spacing = footprint * std::max(z[i], z[j]);
        high = weight > tolerance + spacing && !explained(c, r, c2, r2, tolerance) &&
               !explained(c2, r2, c, r, tolerance);
    }
    const auto code = std::min<std::uint16_t>(compact::Weight::encode(weight), 0x7FFE);
    return static_cast<std::uint16_t>(code | (high ? compact::kHighBit : 0));
}

void ViewPoints::computeEdges(const GraphOptions& options, int row) {
    for (int c = 0; c < width; ++c) {
        const std::size_t i = index(c, row);
        right[i] = c + 1 < width ? edge(options, c, row, c + 1, row) : kNoEdge;
        down[i] = row + 1 < height ? edge(options, c, row, c, row + 1) : kNoEdge;
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
