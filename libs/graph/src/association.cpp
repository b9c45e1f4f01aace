// SPDX-License-Identifier: BSD-3-Clause
#include "association.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

#include "riftmap/core/parallel.h"

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
    bool meets(const PageBounds& box) const {
        const auto& min = box.min;
        const auto& max = box.max;
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

void Association::computeReach(const ViewPoints& view, const GraphOptions& options) {
    tileColumns_ = (view.width + kTile - 1) / kTile;
    tileRows_ = (view.height + kTile - 1) / kTile;
    std::vector<float> own(static_cast<std::size_t>(tileColumns_) *
                           static_cast<std::size_t>(tileRows_));
    const auto tile = [this](int c, int r) {
        return static_cast<std::size_t>(r) * static_cast<std::size_t>(tileColumns_) +
               static_cast<std::size_t>(c);
    };
    parallelFor(static_cast<std::size_t>(tileRows_), 1, [&](std::size_t first, std::size_t) {
        const int tr = static_cast<int>(first);
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
        if (block.vertices == 0 || !frustum.meets(block.bounds)) {
            continue;
        }
        for (const std::uint32_t index : block.pages) {
            if (frustum.meets(storage.bounds(index))) {
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
        pixelOf_[k] = kNone;
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
        const int column = std::clamp(compact::roundNearest(u), 0, view.width - 1);
        const int row = std::clamp(compact::roundNearest(v), 0, view.height - 1);
        const std::size_t tile =
            static_cast<std::size_t>(row / kTile) * static_cast<std::size_t>(tileColumns_) +
            static_cast<std::size_t>(column / kTile);
        const float sigma = compact::Sigma::decode(page.sigma[slot]);
        if (z > reach_[tile] + kNoiseGate * sigma) {
            continue;  // hidden behind everything the view shows there
        }
        candidate = {u, v, z, sigma};
        const std::size_t pixel = view.index(column, row);
        pixelOf_[k] = static_cast<std::uint32_t>(pixel);
        atomic(start_[pixel]).fetch_add(1, std::memory_order_relaxed);
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
    pixelOf_.resize(n);
    start_.assign(view.z.size() + 1, 0);
    parallelFor(pages.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i) {
            projectPage(storage, view, static_cast<std::uint32_t>(i));
        }
    });
    sortByPixel();
}

void Association::sortByPixel() {
    // start_ holds counts now. Each pixel's end first; placing its entries moves it to their start.
    std::uint32_t sum = 0;
    for (std::uint32_t& start : start_) {
        sum += start;
        start = sum;
    }
    constexpr std::size_t kPadding = 64;  // the kernel reads whole vectors
    for (auto* values : {&entryU_, &entryV_, &entryZ_, &entryNoise_}) {
        values->resize(sum + kPadding);
    }
    entryCandidate_.resize(sum + kPadding);
    // The order within a pixel depends on the threads; matching does not depend on that order.
    parallelFor(pixelOf_.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k != end; ++k) {
            if (pixelOf_[k] == kNone) {
                continue;
            }
            const std::uint32_t at =
                atomic(start_[pixelOf_[k]]).fetch_sub(1, std::memory_order_relaxed) - 1;
            const Candidate& o = candidates[k];
            const float noise = kNoiseGate * o.sigma;
            entryU_[at] = o.u;
            entryV_[at] = o.v;
            entryZ_[at] = o.z;
            entryNoise_[at] = noise * noise;
            entryCandidate_[at] = static_cast<std::int32_t>(k);
        }
    });
}

/// The paper's rule: the nearest vertex in space, nearer than gamma.
void Association::matchByDistance(const ViewPoints& view, float gamma, int row, float* distance,
                                  std::int32_t* found) const {
    for (int column = 0; column < view.width; ++column) {
        found[column] = -1;
        const float depth = view.z[view.index(column, row)];
        if (!(depth > 0)) {
            continue;
        }
        const Eigen::Vector3f point = view.inCamera(column, row, depth);
        const int radius = static_cast<int>(gamma / (depth * view.footprint)) + 2;
        const int first = std::max(0, column - radius);
        const int last = std::min(view.width - 1, column + radius);
        float least = gamma * gamma;
        for (int r = std::max(0, row - radius); r <= std::min(view.height - 1, row + radius); ++r) {
            const std::uint32_t end = start_[view.index(last, r) + 1];
            for (std::uint32_t e = start_[view.index(first, r)]; e < end; ++e) {
                const float z = entryZ_[e];
                const Eigen::Vector3f other((entryU_[e] - view.cx) * z / view.fx,
                                            (entryV_[e] - view.cy) * z / view.fy, z);
                const float squared = (other - point).squaredNorm();
                if (squared < least || (squared == least && found[column] >= 0 &&
                                        entryCandidate_[e] < found[column])) {
                    least = squared;
                    found[column] = entryCandidate_[e];
                }
            }
        }
        distance[column] = least;
    }
}

void Association::claim(const ViewPoints& view, float targetResolution, std::size_t pixel,
                        std::uint32_t candidate, float distance) {
    // Positive floats order as their bits do.
    const std::uint64_t key = (std::uint64_t{std::bit_cast<std::uint32_t>(distance)} << 32U) |
                              static_cast<std::uint32_t>(pixel);
    auto slot = atomic(best[candidate]);
    std::uint64_t old = slot.load(std::memory_order_relaxed);
    while (key < old && !slot.compare_exchange_weak(old, key, std::memory_order_relaxed)) {
    }
    const bool fine = view.spacing(pixel) <= targetResolution;
    const auto flag = static_cast<std::uint8_t>(
        (view.kinds[pixel] == 0 ? kSomeSurrounded : kSomeOpen) | (fine ? kSomeFine : 0));
    auto flagSlot = atomic(flags[candidate]);
    if ((flagSlot.load(std::memory_order_relaxed) & flag) != flag) {
        flagSlot.fetch_or(flag, std::memory_order_relaxed);
    }
    atomic(areaOf[candidate])
        .fetch_add(static_cast<std::uint32_t>(view.area[pixel] / kAreaUnit),
                   std::memory_order_relaxed);
}

void Association::match(const ViewPoints& view, const GraphOptions& options) {
    matchOf.resize(view.z.size());
    std::atomic<std::size_t> count{0};
    const auto gamma = static_cast<float>(options.gamma);
    const auto target = static_cast<float>(options.targetResolution);
    const auto matchRows = [&](std::size_t begin, std::size_t end) {
        std::vector<float> distance(static_cast<std::size_t>(view.width));
        std::vector<std::int32_t> found(static_cast<std::size_t>(view.width));
        std::size_t mine = 0;
        for (int r = static_cast<int>(begin); r < static_cast<int>(end); ++r) {
            const std::size_t line = view.index(0, r);
            if (options.fusion == GraphOptions::Fusion::kFirst) {
                matchByDistance(view, gamma, r, distance.data(), found.data());
            } else {
                matchRow({entryU_.data(), entryV_.data(), entryZ_.data(), entryNoise_.data(),
                          entryCandidate_.data(), start_.data(), view.width, view.height, r,
                          view.footprint, gamma, &view.z[line], &view.sigma[line],
                          &view.stretch[line], distance.data(), found.data()});
            }
            for (std::size_t c = 0; c < found.size(); ++c) {
                matchOf[line + c] = kNone;
                if (found[c] >= 0) {
                    matchOf[line + c] = static_cast<std::uint32_t>(found[c]);
                    claim(view, target, line + c, matchOf[line + c], distance[c]);
                    ++mine;
                }
            }
        }
        count.fetch_add(mine, std::memory_order_relaxed);
    };
    parallelFor(static_cast<std::size_t>(view.height), 8, matchRows);
    matched = count.load();
}

}  // namespace riftmap
