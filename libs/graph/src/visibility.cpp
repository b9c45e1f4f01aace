// SPDX-License-Identifier: BSD-3-Clause
#include "visibility.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace riftmap {
namespace {

constexpr float kNearest = 0.01F;     // [m]
constexpr float kNoiseFactor = 3.0F;  // standard deviations that count as "behind"
constexpr float kRounding = 1e-5F;    // of a depth, in single precision, after two transformations

}  // namespace

bool seenThrough(const ViewPoints& view, const Eigen::Vector3f& a, const Eigen::Vector3f& b,
                 const GraphOptions& options) {
    if (a.z() < kNearest || b.z() < kNearest) {
        return false;
    }
    const float ua = view.fx * a.x() / a.z() + view.cx, va = view.fy * a.y() / a.z() + view.cy;
    const float ub = view.fx * b.x() / b.z() + view.cx, vb = view.fy * b.y() / b.z() + view.cy;
    const float longest = 2.0F * static_cast<float>(view.width + view.height);
    if (!(std::max({std::abs(ua), std::abs(va), std::abs(ub), std::abs(vb)}) < longest)) {
        return false;  // most of it lies outside the image
    }
    const int ca = compact::roundNearest(ua), ra = compact::roundNearest(va);
    const int cb = compact::roundNearest(ub), rb = compact::roundNearest(vb);
    const bool paper = options.fusion == GraphOptions::Fusion::kFirst;
    const int length = std::max(std::abs(cb - ca), std::abs(rb - ra));
    const bool skipEnds = !paper && length >= 2;
    const float du = ub - ua, dv = vb - va;
    const float squared = std::max(du * du + dv * dv, 1e-12F);

    int tested = 0, passed = 0;
    forEachLinePixel(ca, ra, cb, rb, [&](int c, int r) {
        if (skipEnds && ((c == ca && r == ra) || (c == cb && r == rb))) {
            return;
        }
        ++tested;
        if (c < 0 || r < 0 || c >= view.width || r >= view.height) {
            return;
        }
        const std::size_t i = view.index(c, r);
        if (!(view.z[i] > 0)) {
            return;
        }
        // The edge's point on this pixel's ray: 1/z is linear along the image line. Both points
        // lie on one ray, so comparing depths compares the distances of eqs. (7) and (8).
        const float along = ((static_cast<float>(c) - ua) * du + (static_cast<float>(r) - va) * dv);
        const float t = std::clamp(along / squared, 0.0F, 1.0F);
        const float depth = 1.0F / ((1.0F - t) / a.z() + t / b.z());
        const float margin =
            paper ? kRounding * depth
                  : std::max(static_cast<float>(options.gamma), kNoiseFactor * view.sigma[i]);
        passed += depth + margin < view.z[i] ? 1 : 0;
    });
    return static_cast<double>(passed) > options.visibility * static_cast<double>(tested);
}

}  // namespace riftmap
