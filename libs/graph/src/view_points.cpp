// SPDX-License-Identifier: BSD-3-Clause
#include "view_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "riftmap/core/parallel.h"
#include "view_kernels.h"

namespace riftmap {
namespace {

constexpr float kNoiseFactor = 3.0F;  // what noise explains, in standard deviations
constexpr std::size_t kRowsAtOnce = 16;
constexpr std::size_t kPatchRowsAtOnce = 4;

template <class F>
void forEachRow(int rows, std::size_t atOnce, F&& f) {
    parallelFor(static_cast<std::size_t>(rows), atOnce, [&f](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r != end; ++r) {
            f(static_cast<int>(r));
        }
    });
}

}  // namespace

void ViewPoints::resize(int newWidth, int newHeight) {
    if (width == newWidth && height == newHeight && !z.empty()) {
        return;
    }
    width = newWidth;
    height = newHeight;
    const auto n = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    for (auto* values : {&z, &sigma, &disparity, &stretch, &area}) {
        values->resize(n);
    }
    right.resize(n + 64, kNoEdge);  // vector code reads whole vectors
    down.resize(n + 64, kNoEdge);
    kinds.resize(n);
    look.resize(n);
    rayX_.resize(static_cast<std::size_t>(width));
    rayY_.resize(static_cast<std::size_t>(height));
    patchColumns_ = (width + kPatch - 1) / kPatch;
    patchRows_ = (height + kPatch - 1) / kPatch;
    patches.resize(static_cast<std::size_t>(patchColumns_) * static_cast<std::size_t>(patchRows_));
    constexpr std::size_t kBehind = 32;  // whole vectors and two patches of the window
    phaseStride_ = static_cast<std::size_t>(kPhasePad + patchColumns_) + kBehind;
    phases_.assign(static_cast<std::size_t>((height + 1) * kPatch) * phaseStride_,
                   std::numeric_limits<float>::quiet_NaN());
}

void ViewPoints::build(const View& view, const GraphOptions& options) {
    const StereoCamera& k = view.camera;
    resize(k.width, k.height);
    fx = static_cast<float>(k.fx);
    fy = static_cast<float>(k.fy);
    cx = static_cast<float>(k.cx);
    cy = static_cast<float>(k.cy);
    fb = static_cast<float>(k.fx * k.baseline);
    footprint = 1.0F / std::min(fx, fy);
    rotation = view.world_T_camera.rotation.cast<float>();
    translation = view.world_T_camera.translation.cast<float>();
    for (int c = 0; c < width; ++c) {
        rayX_[static_cast<std::size_t>(c)] = (static_cast<float>(c) - cx) / fx;
    }
    for (int r = 0; r < height; ++r) {
        rayY_[static_cast<std::size_t>(r)] = (static_cast<float>(r) - cy) / fy;
    }
    validCount = parallelReduce(
        static_cast<std::size_t>(height), kRowsAtOnce, std::size_t{0},
        [&](std::size_t begin, std::size_t end) {
            std::size_t count = 0;
            for (std::size_t r = begin; r != end; ++r) {
                count += computeDepth(view, static_cast<int>(r));
            }
            return count;
        },
        [](std::size_t a, std::size_t b) { return a + b; });
    forEachRow(patchRows_, kPatchRowsAtOnce, [&](int r) { fitPatches(view.disparity, r); });
    forEachRow(patchRows_, kPatchRowsAtOnce, [&](int r) { computeAngles(view.image, r); });
    forEachRow(height, kRowsAtOnce, [&](int r) { computeEdges(options, r); });
    forEachRow(height, kRowsAtOnce,
               [&](int r) { computeKinds(options, view.disparity.firstColumn, r); });
}

std::size_t ViewPoints::computeDepth(const View& view, int row) {
    const std::size_t i = index(0, row);
    const std::size_t count =
        depthsOfRow({&view.disparity.disparity[i], &view.disparity.sigma[i], width,
                     static_cast<float>(view.camera.doffs), fb, &z[i], &sigma[i], &disparity[i]});
    float* phase = phases_.data() + static_cast<std::size_t>(row * kPatch) * phaseStride_ +
                   static_cast<std::size_t>(kPhasePad);
    for (int c = 0; c < width; ++c) {
        phase[static_cast<std::size_t>(c % kPatch) * phaseStride_ +
              static_cast<std::size_t>(c / kPatch)] = disparity[i + static_cast<std::size_t>(c)];
    }
    return count;
}

void ViewPoints::fitPatches(const DisparityImage& image, int patchRow) {
    PatchRow in;
    in.row = std::min(patchRow * kPatch + kPatch / 2, height - 1);
    for (int k = 0; k < PatchRow::kWindow; ++k) {
        in.near[k] = phaseRow(in.row + k - 2);
        in.far[k] = phaseRow(in.row + 3 * (k - 2));
    }
    in.stride = phaseStride_;
    in.deviation = &image.sigma[index(0, in.row)];
    in.width = width;
    in.fx = fx;
    in.fy = fy;
    in.cx = cx;
    in.cy = cy;
    in.fb = fb;
    in.footprint = footprint;
    in.patches = &patches[static_cast<std::size_t>(patchRow * patchColumns_)];
    in.patchCount = patchColumns_;
    fitPatchRow(in);
}

void ViewPoints::computeAngles(const cv::Mat& image, int patchRow) {
    // What a patch says to each of its columns, once for its rows.
    const auto w = static_cast<std::size_t>(width);
    thread_local std::vector<float> columns;
    thread_local std::vector<std::uint8_t> onPlane;
    columns.resize(4 * w);
    onPlane.resize(w);
    float* const value = columns.data();
    float *const slope = value + w, *const tolerance = slope + w, *const inverse = tolerance + w;
    const PatchPlane* plane = &patches[static_cast<std::size_t>(patchRow * patchColumns_)];
    for (int c = 0; c < width; ++c) {
        const PatchPlane& p = plane[c / kPatch];
        value[c] = p.value + p.slopeColumn * static_cast<float>(c - p.column);
        slope[c] = p.slopeRow;
        tolerance[c] = p.tolerance;
        inverse[c] = p.inverseDistance;
    }
    for (int r = patchRow * kPatch; r < std::min(height, (patchRow + 1) * kPatch); ++r) {
        const std::size_t line = index(0, r);
        AngleRow in;
        in.z = &z[line];
        in.disparity = &disparity[line];
        in.rayX = rayX_.data();
        in.rayY = rayY_[static_cast<std::size_t>(r)];
        in.fxfy = fx * fy;
        in.rowsFromCentre = static_cast<float>(r - plane->row);
        in.width = width;
        in.value = value;
        in.slopeRow = slope;
        in.tolerance = tolerance;
        in.inverse = inverse;
        in.stretch = &stretch[line];
        in.area = &area[line];
        anglesOfRow(in, onPlane.data());
        for (int c = 0; c < width; ++c) {
            const std::size_t i = line + static_cast<std::size_t>(c);
            if (onPlane[static_cast<std::size_t>(c)] == 0 && z[i] > 0) {
                const float angle = angleFromNeighbours(c, r);
                stretch[i] = angle > 0 ? std::clamp(angle, 1.0F, kLargestStretch) : 0.0F;
            }
        }
        areasOfRow(in);
        looksOfRow({image.empty() ? nullptr : image.ptr<std::uint8_t>(r),
                    image.empty() ? 0 : image.channels(), onPlane.data(), width, &look[line]});
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

/// The code without its high bit where the viewing angle explains the weight.
std::uint16_t ViewPoints::explainedByAngle(std::uint16_t code, float target, int c, int r, int c2,
                                           int r2) const {
    const std::size_t i = index(c, r), j = index(c2, r2);
    const float noise = kNoiseFactor * std::sqrt(sigma[i] * sigma[i] + sigma[j] * sigma[j]);
    const bool low =
        explained(c, r, c2, r2, target + noise) || explained(c2, r2, c, r, target + noise);
    return low ? static_cast<std::uint16_t>(code & ~compact::kHighBit) : code;
}

void ViewPoints::computeEdges(const GraphOptions& options, int row) {
    const std::size_t line = index(0, row);
    const auto target = static_cast<float>(options.targetResolution);
    EdgeRow in;
    in.delta = static_cast<float>(options.delta);
    in.target = target;
    in.footprint = footprint;
    in.z = &z[line];
    in.sigma = &sigma[line];
    in.rayX = rayX_.data();
    in.rayY = in.rayY2 = rayY_[static_cast<std::size_t>(row)];
    in.z2 = in.z + 1;
    in.sigma2 = in.sigma + 1;
    in.rayX2 = in.rayX + 1;
    in.count = width - 1;
    in.code = &right[line];
    edgesOfRow(in);
    right[line + static_cast<std::size_t>(width - 1)] = kNoEdge;
    if (row + 1 < height) {
        in.z2 = in.z + width;
        in.sigma2 = in.sigma + width;
        in.rayX2 = in.rayX;
        in.rayY2 = rayY_[static_cast<std::size_t>(row) + 1];
        in.count = width;
        in.code = &down[line];
        edgesOfRow(in);
    } else {
        std::fill_n(&down[line], width, kNoEdge);
    }
    if (options.delta > 0) {
        return;
    }
    const auto mayBeHigh = [](std::uint16_t code) {
        return code != kNoEdge && (code & compact::kHighBit) != 0;
    };
    for (int c = 0; c < width; ++c) {
        std::uint16_t& beside = right[line + static_cast<std::size_t>(c)];
        if (mayBeHigh(beside)) {
            beside = explainedByAngle(beside, target, c, row, c + 1, row);
        }
        std::uint16_t& below = down[line + static_cast<std::size_t>(c)];
        if (mayBeHigh(below)) {
            below = explainedByAngle(below, target, c, row, c, row + 1);
        }
    }
}

void ViewPoints::computeKinds(const GraphOptions& options, int firstColumn, int row) {
    const auto w = static_cast<std::size_t>(width);
    const std::size_t line = index(0, row);
    const auto atBorder = [&](int c) {
        const std::size_t i = line + static_cast<std::size_t>(c);
        unsigned bits = 0;
        const auto lookAtEdge = [&](int c2, int r2, std::uint16_t code) {
            if (c2 < 0 || r2 < 0 || c2 >= width || r2 >= height) {
                bits |= kImageBorder;
            } else if (code == kNoEdge) {
                bits |= c2 < firstColumn ? kImageBorder : kNoMatch;
            } else if ((code & compact::kHighBit) != 0) {
                bits |= kDepthStep;
            }
        };
        if (z[i] > 0) {
            lookAtEdge(c + 1, row, right[i]);
            lookAtEdge(c, row + 1, down[i]);
            lookAtEdge(c - 1, row, c > 0 ? right[i - 1] : kNoEdge);
            lookAtEdge(c, row - 1, row > 0 ? down[i - w] : kNoEdge);
        }
        kinds[i] = static_cast<std::uint8_t>(bits);
    };
    if (row == 0 || row + 1 == height) {
        for (int c = 0; c < width; ++c) {
            atBorder(c);
        }
    } else {
        atBorder(0);
        kindsOfRow({&z[line], &right[line], &down[line], &down[line - w], width, firstColumn,
                    &kinds[line]});
        atBorder(width - 1);
    }
    if (!options.typedOpenness) {
        std::for_each_n(&kinds[line], width, [](std::uint8_t& bits) { bits &= kDepthStep; });
    }
}

}  // namespace riftmap
