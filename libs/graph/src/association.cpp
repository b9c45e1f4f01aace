// SPDX-License-Identifier: BSD-3-Clause
#include "association.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "riftmap/core/parallel.h"

namespace riftmap {
namespace {

constexpr float kNearest = 0.01F;  // [m] a vertex nearer than this to the camera is not in view
constexpr float kBorder = 2.0F;    // [px] vertices this far outside still meet border pixels

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

}  // namespace

void Association::computeReach(const ViewPoints& view, const GraphOptions& options) {
    tileColumns_ = (view.width + kTile - 1) / kTile;
    tileRows_ = (view.height + kTile - 1) / kTile;
    const auto tile = [this](int c, int r) {
        return static_cast<std::size_t>(r) * static_cast<std::size_t>(tileColumns_) +
               static_cast<std::size_t>(c);
    };
    auto& own = ownReach_;
    own.resize(static_cast<std::size_t>(tileColumns_) * static_cast<std::size_t>(tileRows_));
    const bool paper = options.fusion == GraphOptions::Fusion::kFirst;
    parallelFor(static_cast<std::size_t>(tileRows_), 2, [&](std::size_t begin, std::size_t end) {
        std::vector<float> most(static_cast<std::size_t>(tileColumns_ * kTile));
        for (int tr = static_cast<int>(begin); tr < static_cast<int>(end); ++tr) {
            std::fill(most.begin(), most.end(), 0.0F);
            for (int r = tr * kTile; r < std::min(view.height, (tr + 1) * kTile); ++r) {
                const std::size_t i = view.index(0, r);
                reachOfRow({&view.z[i], &view.sigma[i], &view.stretch[i], view.width,
                            static_cast<float>(options.gamma), view.footprint, paper},
                           most.data());
            }
            for (int tc = 0; tc < tileColumns_; ++tc) {
                const auto first = most.begin() + static_cast<std::ptrdiff_t>(tc) * kTile;
                own[tile(tc, tr)] = *std::max_element(first, first + kTile);
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

void Association::projectPages(const GraphStorage& storage, const ViewPoints& view) {
    const std::size_t n = candidateCount();
    for (auto* values : {&u_, &v_, &z_, &sigma_}) {
        values->resize(n);
    }
    pixelOf_.resize(n);
    claims.resize(n);
    inView_.resize(pages.size());
    rowsOf_.resize(pages.size());
    Projection in;
    std::copy_n(view.rotation.data(), 9, in.rotation.begin());
    std::copy_n(view.translation.data(), 3, in.translation.begin());
    in.fx = view.fx;
    in.fy = view.fy;
    in.cx = view.cx;
    in.cy = view.cy;
    in.width = view.width;
    in.height = view.height;
    in.nearest = kNearest;
    in.border = kBorder;
    in.reach = reach_.data();
    static_assert(kTile == 8, "as the kernel has it");
    in.tileColumns = tileColumns_;
    in.noiseGate = kNoiseGate;
    parallelFor(pages.size(), 32, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i) {
            if (i + 2 < end) {
                const Page& next = storage.page(pages[i + 2]);
                prefetch(&next.x, 3 * sizeof(next.x));
                prefetch(&next.sigma, sizeof(next.sigma));
                prefetch(&next.alive, sizeof(next.alive));
            }
            const std::size_t k = i * Page::kSize;
            ProjectedPage out{&u_[k], &v_[k], &z_[k], &sigma_[k], &pixelOf_[k]};
            projectPage(storage.page(pages[i]), in, out);
            inView_[i] = out.inView;
            rowsOf_[i] = {out.firstRow, out.lastRow};
            std::fill_n(&claims[k], Page::kSize, Claims{});
        }
    });
}

void Association::project(const GraphStorage& storage, const ViewPoints& view,
                          const GraphOptions& options) {
    computeReach(view, options);
    cull(storage, view);
    projectPages(storage, view);
    sortByPixel(view);
}

/// f(candidate) for those in view whose pixel lies in these rows.
template <class F>
void Association::forEachCandidateOn(int firstRow, int endRow, int width, F&& f) const {
    const auto first = static_cast<std::uint32_t>(firstRow * width);
    const auto count = static_cast<std::uint32_t>((endRow - firstRow) * width);
    for (std::size_t i = 0; i < pages.size(); ++i) {
        if (rowsOf_[i].first >= endRow || rowsOf_[i].second < firstRow) {
            continue;
        }
        forEachBit(inView_[i], [&](std::uint32_t slot) {
            const std::size_t k = i * Page::kSize + slot;
            if (pixelOf_[k] - first < count) {
                f(k);
            }
        });
    }
}

void Association::countEntries(const ViewPoints& view, int strip) {
    const int first = strip * kStripRows, end = std::min(view.height, first + kStripRows);
    const auto w = static_cast<std::uint32_t>(view.width);
    std::fill(start_.begin() + static_cast<std::ptrdiff_t>(first) * (view.width + 1),
              start_.begin() + static_cast<std::ptrdiff_t>(end) * (view.width + 1), 0U);
    std::size_t n = 0;
    forEachCandidateOn(first, end, view.width, [&](std::size_t k) {
        ++start_[pixelOf_[k] + pixelOf_[k] / w];
        ++n;
    });
    strips_[static_cast<std::size_t>(strip)].entries = n;
}

void Association::placeEntries(const ViewPoints& view, int strip, std::size_t before) {
    const int first = strip * kStripRows, end = std::min(view.height, first + kStripRows);
    const auto w = static_cast<std::uint32_t>(view.width);
    // Counts become ends; placing moves each pixel's end to its start.
    auto sum = static_cast<std::uint32_t>(before);
    for (std::size_t i = static_cast<std::size_t>(first) * (w + 1);
         i < static_cast<std::size_t>(end) * (w + 1); ++i) {
        sum += start_[i];
        start_[i] = sum;
    }
    forEachCandidateOn(first, end, view.width, [&](std::size_t k) {
        const std::uint32_t at = --start_[pixelOf_[k] + pixelOf_[k] / w];
        const float noise = kNoiseGate * sigma_[k];
        entries_[at] = {u_[k], v_[k], z_[k], noise * noise, static_cast<std::int32_t>(k)};
    });
}

void Association::sortByPixel(const ViewPoints& view) {
    start_.resize(static_cast<std::size_t>(view.height) *
                  (static_cast<std::size_t>(view.width) + 1));
    strips_.resize(static_cast<std::size_t>((view.height + kStripRows - 1) / kStripRows));
    parallelFor(strips_.size(), 1, [&](std::size_t strip, std::size_t) {
        countEntries(view, static_cast<int>(strip));
    });
    std::vector<std::size_t> before(strips_.size() + 1, 0);
    for (std::size_t s = 0; s < strips_.size(); ++s) {
        before[s + 1] = before[s] + strips_[s].entries;
    }
    entries_.resize(before.back());
    parallelFor(strips_.size(), 1, [&](std::size_t strip, std::size_t) {
        placeEntries(view, static_cast<int>(strip), before[strip]);
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
            const std::uint32_t* start = &start_[view.index(0, r) + static_cast<std::size_t>(r)];
            for (std::uint32_t e = start[first]; e < start[last + 1]; ++e) {
                const auto& [u, v, z, noise, candidate] = entries_[e];
                const Eigen::Vector3f other((u - view.cx) * z / view.fx,
                                            (v - view.cy) * z / view.fy, z);
                const float squared = (other - point).squaredNorm();
                if (squared < least ||
                    (squared == least && found[column] >= 0 && candidate < found[column])) {
                    least = squared;
                    found[column] = candidate;
                }
            }
        }
        distance[column] = least;
    }
}

void Association::claim(const ViewPoints& view, float targetResolution, const Strip::Claim& claim) {
    const std::uint32_t pixel = claim.pixel;
    Claims& all = claims[claim.candidate];
    // Positive floats order as their bits do.
    all.best = std::min(
        all.best, (std::uint64_t{std::bit_cast<std::uint32_t>(claim.distance)} << 32U) | pixel);
    const bool fine = view.spacing(pixel) <= targetResolution;
    all.flags |= view.kinds[pixel] == 0 ? kSomeSurrounded : kSomeOpen;
    all.flags |= static_cast<std::uint32_t>(view.kinds[pixel]) << kKindsShift;
    all.flags |= fine ? unsigned{kSomeFine} : 0U;
    all.area += static_cast<std::uint32_t>(view.area[pixel] / kAreaUnit);
}

void Association::matchStrip(const ViewPoints& view, const GraphOptions& options, int index) {
    Strip& strip = strips_[static_cast<std::size_t>(index)];
    strip.distance.resize(static_cast<std::size_t>(view.width));
    strip.found.resize(static_cast<std::size_t>(view.width));
    strip.foreign.clear();
    strip.matched = 0;
    const auto gamma = static_cast<float>(options.gamma);
    const auto target = static_cast<float>(options.targetResolution);
    const int first = index * kStripRows, end = std::min(view.height, first + kStripRows);
    const auto own = static_cast<std::uint32_t>(first * view.width);
    const auto ownCount = static_cast<std::uint32_t>((end - first) * view.width);
    for (int r = first; r < end; ++r) {
        const std::size_t line = view.index(0, r);
        if (options.fusion == GraphOptions::Fusion::kFirst) {
            matchByDistance(view, gamma, r, strip.distance.data(), strip.found.data());
        } else {
            matchRow({entries_.data(), start_.data(), view.width, view.height, r, view.footprint,
                      gamma, &view.z[line], &view.sigma[line], &view.stretch[line],
                      strip.distance.data(), strip.found.data()});
        }
        for (std::size_t c = 0; c < strip.found.size(); ++c) {
            constexpr std::size_t kAhead = 16;
            if (c + kAhead < strip.found.size() && strip.found[c + kAhead] >= 0) {
                const auto next = static_cast<std::size_t>(strip.found[c + kAhead]);
                __builtin_prefetch(&claims[next]);
                __builtin_prefetch(&pixelOf_[next]);
            }
            matchOf[line + c] = static_cast<std::uint32_t>(strip.found[c]);
            if (strip.found[c] >= 0) {
                const Strip::Claim claimed{matchOf[line + c], static_cast<std::uint32_t>(line + c),
                                           strip.distance[c]};
                if (pixelOf_[claimed.candidate] - own < ownCount) {
                    claim(view, target, claimed);
                } else {
                    strip.foreign.push_back(claimed);
                }
                ++strip.matched;
            }
        }
    }
}

void Association::match(const ViewPoints& view, const GraphOptions& options) {
    static_assert(static_cast<std::uint32_t>(-1) == kNone);
    matchOf.resize(view.z.size());
    parallelFor(strips_.size(), 1, [&](std::size_t strip, std::size_t) {
        matchStrip(view, options, static_cast<int>(strip));
    });
    matched = 0;
    for (const Strip& strip : strips_) {
        matched += strip.matched;
        for (const Strip::Claim& claimed : strip.foreign) {
            claim(view, static_cast<float>(options.targetResolution), claimed);
        }
    }
}

std::size_t Association::memoryBytes() const {
    std::size_t bytes = bytesOf(pages) + bytesOf(matchOf) + bytesOf(claims) + bytesOf(ownReach_) +
                        bytesOf(reach_) + bytesOf(u_) + bytesOf(v_) + bytesOf(z_) +
                        bytesOf(sigma_) + bytesOf(pixelOf_) + bytesOf(inView_) + bytesOf(rowsOf_) +
                        bytesOf(entries_) + bytesOf(start_);
    for (const Strip& strip : strips_) {
        bytes += bytesOf(strip.foreign) + bytesOf(strip.distance) + bytesOf(strip.found);
    }
    return bytes;
}

}  // namespace riftmap
