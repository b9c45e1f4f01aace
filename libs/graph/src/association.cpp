// SPDX-License-Identifier: BSD-3-Clause
#include "association.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

namespace riftmap {
namespace {

constexpr float kNearest = 0.01F;  // [m] a vertex nearer than this to the camera is not in view
constexpr float kBorder = 2.0F;    // [px] vertices this far outside still meet border pixels
constexpr std::uint64_t kNoBest = 0xFFFFFFFFFFFFFFFFULL;

/// The image's pyramid, widened by kBorder; a box outside of one of its planes is not in view.
class Frustum {
 public:
    Frustum(const ViewPoints& view, float farthest) : translation_(view.translation) {
        const float left = (-0.5F - kBorder - view.cx) / view.fx;
        const float right = (static_cast<float>(view.width) - 0.5F + kBorder - view.cx) / view.fx;
        const float top = (-0.5F - kBorder - view.cy) / view.fy;
        const float bottom = (static_cast<float>(view.height) - 0.5F + kBorder - view.cy) / view.fy;
        const std::array<Eigen::Vector3f, 6> inCamera = {
            Eigen::Vector3f(1, 0, -left), Eigen::Vector3f(-1, 0, right),
            Eigen::Vector3f(0, 1, -top),  Eigen::Vector3f(0, -1, bottom),
            Eigen::Vector3f(0, 0, 1),     Eigen::Vector3f(0, 0, -1)};
        for (std::size_t i = 0; i < planes_.size(); ++i) {
            planes_[i] = view.rotation * inCamera[i];
        }
        offsets_ = {0, 0, 0, 0, -kNearest, farthest};
    }
    bool meets(const std::array<float, 3>& min, const std::array<float, 3>& max) const {
        const Eigen::Vector3f low = Eigen::Vector3f(min[0], min[1], min[2]) - translation_;
        const Eigen::Vector3f high = Eigen::Vector3f(max[0], max[1], max[2]) - translation_;
        for (std::size_t i = 0; i < planes_.size(); ++i) {
            const Eigen::Vector3f& n = planes_[i];
            const float most = n.x() * (n.x() > 0 ? high.x() : low.x()) +
                               n.y() * (n.y() > 0 ? high.y() : low.y()) +
                               n.z() * (n.z() > 0 ? high.z() : low.z()) + offsets_[i];
            if (most < 0) {
                return false;
            }
        }
        return true;
    }

 private:
    std::array<Eigen::Vector3f, 6> planes_;
    std::array<float, 6> offsets_{};
    Eigen::Vector3f translation_;
};

template <class T>
std::atomic_ref<T> atomic(T& value) {
    return std::atomic_ref<T>(value);
}

}  // namespace

Association::Gate Association::gate(const ViewPoints& view, std::size_t pixel,
                                    const GraphOptions& options) {
    const auto gamma = static_cast<float>(options.gamma);
    if (options.fusion == GraphOptions::Fusion::kFirst) {
        return {gamma, gamma};
    }
    // Never below what the noise and the sampling at that depth blur anyway.
    const float spacing = 0.75F * view.z[pixel] * view.footprint;
    return {std::max(gamma, spacing),
            std::max({gamma, kNoiseGate * view.sigma[pixel], spacing * view.stretch[pixel]})};
}

void Association::computeReach(const ViewPoints& view, const GraphOptions& options) {
    tileColumns_ = (view.width + kTile - 1) / kTile;
    tileRows_ = (view.height + kTile - 1) / kTile;
    std::vector<float> own(static_cast<std::size_t>(tileColumns_) *
                           static_cast<std::size_t>(tileRows_));
    const auto tile = [this](int c, int r) {
        return static_cast<std::size_t>(r) * static_cast<std::size_t>(tileColumns_) +
               static_cast<std::size_t>(c);
    };
    tbb::parallel_for(0, tileRows_, [&](int tr) {
        for (int r = tr * kTile; r < std::min(view.height, (tr + 1) * kTile); ++r) {
            for (int c = 0; c < view.width; ++c) {
                const std::size_t i = view.index(c, r);
                if (view.z[i] > 0) {
                    float& most = own[tile(c / kTile, tr)];
                    most = std::max(most, view.z[i] + gate(view, i, options).depth);
                }
            }
        }
    });
    reach_.assign(own.size(), 0.0F);
    farthest_ = 0;
    for (int r = 0; r < tileRows_; ++r) {
        for (int c = 0; c < tileColumns_; ++c) {
            float& most = reach_[tile(c, r)];
            for (int r2 = std::max(0, r - 1); r2 <= std::min(tileRows_ - 1, r + 1); ++r2) {
                for (int c2 = std::max(0, c - 1); c2 <= std::min(tileColumns_ - 1, c + 1); ++c2) {
                    most = std::max(most, own[tile(c2, r2)]);
                }
            }
            farthest_ = std::max(farthest_, most);
        }
    }
}

void Association::cull(const GraphStorage& storage, const ViewPoints& view) {
    pages.clear();
    // A vertex known badly may match from behind the farthest pixel.
    const Frustum frustum(view, 1.5F * farthest_);
    for (const Block& block : storage.blocks()) {
        if (block.vertices == 0 || !frustum.meets(block.min, block.max)) {
            continue;
        }
        for (const std::uint32_t index : block.pages) {
            const Page& page = storage.page(index);
            if (page.alive != 0 && frustum.meets(page.min, page.max)) {
                pages.push_back(index);
            }
        }
    }
    std::sort(pages.begin(), pages.end());
}

void Association::projectPage(const GraphStorage& storage, const ViewPoints& view,
                              std::uint32_t which) {
    const Page& page = storage.page(pages[which]);
    const Eigen::Matrix3f& r = view.rotation;  // its columns are the camera's axes
    const float right = static_cast<float>(view.width) - 0.5F;
    const float bottom = static_cast<float>(view.height) - 0.5F;
    for (std::uint32_t slot = 0; slot < Page::kSize; ++slot) {
        const std::uint32_t k = which * Page::kSize + slot;
        Candidate& candidate = candidates[k];
        candidate.z = 0;
        best[k] = kNoBest;
        flags[k] = 0;
        areaOf[k] = 0;
        if (!page.living(slot)) {
            continue;
        }
        const float dx = page.x[slot] - view.translation.x();
        const float dy = page.y[slot] - view.translation.y();
        const float dz = page.z[slot] - view.translation.z();
        const float z = r(0, 2) * dx + r(1, 2) * dy + r(2, 2) * dz;
        if (z < kNearest) {
            continue;
        }
        const float u = view.fx * (r(0, 0) * dx + r(1, 0) * dy + r(2, 0) * dz) / z + view.cx;
        const float v = view.fy * (r(0, 1) * dx + r(1, 1) * dy + r(2, 1) * dz) / z + view.cy;
        if (!(u >= -0.5F - kBorder && u < right + kBorder && v >= -0.5F - kBorder &&
              v < bottom + kBorder)) {
            continue;
        }
        const int column = std::clamp(static_cast<int>(std::lround(u)), 0, view.width - 1);
        const int row = std::clamp(static_cast<int>(std::lround(v)), 0, view.height - 1);
        const std::size_t tile =
            static_cast<std::size_t>(row / kTile) * static_cast<std::size_t>(tileColumns_) +
            static_cast<std::size_t>(column / kTile);
        const float sigma = compact::Sigma::decode(page.sigma[slot]);
        if (z > reach_[tile] + kNoiseGate * sigma) {
            continue;  // hidden behind everything the view shows there
        }
        candidate = {u, v, z, sigma};
        atomic(occupied_[tile]).store(1, std::memory_order_relaxed);
        next_[k] = atomic(head_[view.index(column, row)]).exchange(k, std::memory_order_relaxed);
    }
}

void Association::project(const GraphStorage& storage, const ViewPoints& view,
                          const GraphOptions& options) {
    computeReach(view, options);
    cull(storage, view);
    const std::size_t n = candidateCount();
    candidates.resize(n);
    best.resize(n);
    flags.resize(n);
    areaOf.resize(n);
    next_.resize(n);
    head_.assign(view.z.size(), kNone);
    occupied_.assign(reach_.size(), 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pages.size(), 16),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                          for (std::size_t i = range.begin(); i != range.end(); ++i) {
                              projectPage(storage, view, static_cast<std::uint32_t>(i));
                          }
                      });
}

std::uint32_t Association::matchPixel(const ViewPoints& view, const GraphOptions& options,
                                      int column, int row) {
    const std::size_t pixel = view.index(column, row);
    const float depth = view.z[pixel];
    const Gate g = gate(view, pixel, options);
    const bool paper = options.fusion == GraphOptions::Fusion::kFirst;
    const float perPixel = depth * view.footprint;  // lateral [m] a pixel
    const int radius = static_cast<int>(g.lateral / perPixel + 0.5F) + 1;
    const Eigen::Vector3f point = view.inCamera(column, row, depth);
    std::uint32_t found = kNone;
    float least = std::numeric_limits<float>::infinity();

    const auto look = [&](int c, int r) {
        for (std::uint32_t k = head_[view.index(c, r)]; k != kNone; k = next_[k]) {
            const Candidate& o = candidates[k];
            float distance = 0;
            if (paper) {
                const Eigen::Vector3f other((o.u - view.cx) * o.z / view.fx,
                                            (o.v - view.cy) * o.z / view.fy, o.z);
                const float squared = (other - point).squaredNorm();
                if (!(squared < g.depth * g.depth)) {
                    continue;
                }
                distance = squared / (g.depth * g.depth);
            } else {
                const float du = o.u - static_cast<float>(column);
                const float dv = o.v - static_cast<float>(row);
                const float lateral =
                    (du * du + dv * dv) * perPixel * perPixel / (g.lateral * g.lateral);
                const float noise = kNoiseGate * kNoiseGate *
                                    (view.sigma[pixel] * view.sigma[pixel] + o.sigma * o.sigma);
                const float along = std::max(g.depth * g.depth, noise);
                const float behind = (o.z - depth) * (o.z - depth);
                if (lateral > 1.0F || behind > along) {
                    continue;
                }
                distance = lateral + behind / along;
            }
            if (distance < least || (distance == least && k < found)) {
                least = distance;
                found = k;
            }
        }
    };
    for (int ring = 0; ring <= radius; ++ring) {
        // Nothing in this ring or farther out can be nearer than this.
        const float nearest =
            std::max(0.0F, static_cast<float>(ring) - 0.5F) * perPixel / g.lateral;
        if (found != kNone && !paper && nearest * nearest > least) {
            break;
        }
        const int top = row - ring, bottom = row + ring;
        for (int r = std::max(0, top); r <= std::min(view.height - 1, bottom); ++r) {
            const bool edge = r == top || r == bottom;
            const int step = edge || ring == 0 ? 1 : 2 * ring;
            for (int c = column - ring; c <= column + ring; c += step) {
                if (c >= 0 && c < view.width) {
                    look(c, r);
                }
            }
        }
    }
    if (found != kNone) {
        // Positive floats order as their bits do.
        const std::uint64_t key = (std::uint64_t{std::bit_cast<std::uint32_t>(least)} << 32U) |
                                  static_cast<std::uint32_t>(pixel);
        auto slot = atomic(best[found]);
        std::uint64_t old = slot.load(std::memory_order_relaxed);
        while (key < old && !slot.compare_exchange_weak(old, key, std::memory_order_relaxed)) {
        }
        const bool fine =
            perPixel * view.stretch[pixel] <= static_cast<float>(options.targetResolution);
        const auto flag = static_cast<std::uint8_t>(
            (view.kinds[pixel] == 0 ? kSomeSurrounded : kSomeOpen) | (fine ? kSomeFine : 0));
        auto flagSlot = atomic(flags[found]);
        if ((flagSlot.load(std::memory_order_relaxed) & flag) != flag) {
            flagSlot.fetch_or(flag, std::memory_order_relaxed);
        }
        atomic(areaOf[found])
            .fetch_add(static_cast<std::uint32_t>(view.area(column, row) / kAreaUnit),
                       std::memory_order_relaxed);
    }
    return found;
}

void Association::match(const ViewPoints& view, const GraphOptions& options) {
    matchOf.resize(view.z.size());
    std::atomic<std::size_t> count{0};
    tbb::parallel_for(
        tbb::blocked_range<int>(0, view.height, 8), [&](const tbb::blocked_range<int>& range) {
            std::size_t mine = 0;
            for (int r = range.begin(); r != range.end(); ++r) {
                for (int c = 0; c < view.width; ++c) {
                    const std::size_t i = view.index(c, r);
                    matchOf[i] = view.z[i] > 0 ? matchPixel(view, options, c, r) : kNone;
                    mine += matchOf[i] != kNone ? 1 : 0;
                }
            }
            count.fetch_add(mine, std::memory_order_relaxed);
        });
    matched = count.load();
}

}  // namespace riftmap
