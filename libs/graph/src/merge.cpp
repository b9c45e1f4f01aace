// SPDX-License-Identifier: BSD-3-Clause
#include "merge.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>

#include "edge_kernel.h"
#include "fuse_kernel.h"
#include "merge_codes.h"
#include "normals.h"
#include "riftmap/core/parallel.h"
#include "visibility.h"

namespace riftmap {
namespace {

constexpr float kNoiseFactor = 3.0F;       // standard deviations
constexpr unsigned kDeletingEvidence = 2;  // views
constexpr std::uint32_t kPagesAtOnce = 16;
constexpr int kTile = 8;

/// Time since the last call [ms].
class StopWatch {
 public:
    double lap() {
        const auto now = std::chrono::steady_clock::now();
        const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
        last_ = now;
        return ms;
    }

 private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace

MergeResult Merger::merge(const View& view, GraphStorage& storage, RiftFinder& rifts,
                          std::int64_t& area) {
    MergeResult result;
    StopWatch watch;
    points_.build(view, options_);
    times_.points = watch.lap();
    seen_.project(storage, points_, options_);
    seen_.match(points_, options_);
    times_.associate = watch.lap();

    work_.assign(seen_.pages.size(), PageWork{});
    touchedBlocks_.clear();
    forEach(work_.size(), kPagesAtOnce,
            [&](std::size_t i) { findSeenThroughEdges(storage, static_cast<std::uint32_t>(i)); });
    forEach(work_.size(), kPagesAtOnce,
            [&](std::size_t i) { fusePage(storage, static_cast<std::uint32_t>(i)); });
    deleteSeenThrough(storage, rifts, result);
    times_.fuse = watch.lap();

    grow(storage, result);
    times_.grow = watch.lap();
    connectMatched(storage, result);
    times_.edges = watch.lap();
    refreshNormals(storage);
    finish(storage, rifts, area);
    times_.normals = watch.lap();

    result.rawPoints = points_.validCount;
    result.matched = seen_.matched;
    return result;
}

/// Asks for a page in view before its turn comes: pages lie anywhere, so the processor cannot
/// foresee.
void Merger::prefetchPage(const GraphStorage& storage, std::uint32_t which) const {
    if (which < seen_.pages.size()) {
        const Page& page = storage.page(seen_.pages[which]);
        prefetch(&page, offsetof(Page, neighbour));
        prefetch(&page.weight, sizeof(page.weight));
        prefetch(&page.alive, sizeof(page.alive));
    }
}

void Merger::findSeenThroughEdges(const GraphStorage& storage, std::uint32_t which) {
    const std::uint32_t index = seen_.pages[which];
    const Page& page = storage.page(index);
    const auto inCamera = [this](const Eigen::Vector3f& p) -> Eigen::Vector3f {
        return points_.rotation.transpose() * (p - points_.translation);
    };
    prefetchPage(storage, which + 1);
    if (!page.mayHaveHighEdges()) {
        return;
    }
    forEachBit(seen_.slotsInView(which), [&](std::uint32_t slot) {
        if (!page.mayHaveHighEdge(slot)) {
            return;
        }
        const VertexId id = GraphStorage::idOf(index, slot);
        storage.forEachHalfEdge(id, [&](VertexId n, std::uint16_t code) {
            if ((code & compact::kHighBit) == 0) {
                return;
            }
            // From either end the same answer: always look from the smaller id to the larger.
            const VertexId a = std::min(id, n), b = std::max(id, n);
            if (seenThrough(points_, inCamera(storage.position(a)), inCamera(storage.position(b)),
                            options_)) {
                work_[which].cut.emplace_back(a, b);
            }
        });
    });
}

/// True unless vertex and pixel lie on two sides of an edge: the surface that the pixel shows is
/// not the vertex' own then, however near it lies.
bool Merger::sameSide(std::uint32_t normal, std::size_t pixel) const {
    const auto w = static_cast<std::uint32_t>(points_.width);
    const auto i = static_cast<std::uint32_t>(pixel);
    const int column = static_cast<int>(i % w), row = static_cast<int>(i / w);
    if (normal == 0 || !points_.onPatch(column, row)) {
        return true;
    }
    const Eigen::Vector3f seen = points_.rotation * points_.patch(column, row).normal;
    return compact::decodeDirection(normal).dot(seen) >= kSameSide;
}

bool Merger::lookedThrough(const Candidate& candidate) const {
    const int column = compact::roundNearest(candidate.u);
    const int row = compact::roundNearest(candidate.v);
    if (column < 1 || row < 1 || column + 1 >= points_.width || row + 1 >= points_.height) {
        return false;
    }
    // All pixels around must show something behind: the vertex of a thin thing that lies half a
    // pixel beside it is not looked through.
    for (int r = row - 1; r <= row + 1; ++r) {
        for (int c = column - 1; c <= column + 1; ++c) {
            const std::size_t i = points_.index(c, r);
            const float sigma =
                std::sqrt(points_.sigma[i] * points_.sigma[i] + candidate.sigma * candidate.sigma);
            const float margin = std::max(kNoiseFactor * sigma, points_.spacing(i));
            if (!(points_.z[i] > candidate.z + margin)) {
                return false;
            }
        }
    }
    return true;
}

void Merger::passOver(Page& page, std::uint32_t slot, std::uint32_t candidate, PageWork& work) {
    const Candidate seen = seen_.candidate(candidate);
    if (lookedThrough(seen)) {
        const unsigned evidence = evidenceOf(page.state[slot]) + 1;
        page.state[slot] = withEvidence(page.state[slot], evidence);
        if (evidence >= kDeletingEvidence) {
            work.doomed |= std::uint64_t{1} << slot;
        }
        return;
    }
    const int column = compact::roundNearest(seen.u), row = compact::roundNearest(seen.v);
    if (column < 0 || row < 0 || column >= points_.width || row >= points_.height) {
        return;
    }
    const std::size_t i = points_.index(column, row);
    if (!(points_.z[i] > 0)) {
        return;
    }
    // The depth that the view shows at the vertex itself, which lies beside the pixel's centre.
    float disparity = points_.disparity[i];
    if (points_.onPatch(column, row)) {
        const PatchPlane& patch = points_.patch(column, row);
        disparity += patch.slopeColumn * (seen.u - static_cast<float>(column)) +
                     patch.slopeRow * (seen.v - static_cast<float>(row));
    }
    const float depth = points_.fb / disparity;
    const float near = std::max(Association::gate(points_, i, options_).depth,
                                kNoiseGate * std::hypot(points_.sigma[i], seen.sigma));
    if (!(std::abs(depth - seen.z) <= near)) {
        return;
    }
    // The surface goes on around it in this view, whichever vertex its pixels chose.
    page.state[slot] = static_cast<std::uint8_t>(
        page.state[slot] | (points_.kinds[i] == 0 ? kSurrounded : 0) |
        (points_.spacing(i) <= static_cast<float>(options_.targetResolution) ? kFineEnough : 0));
    fuseAlongRay(page, slot, seen, depth, points_.sigma[i], work);
    if (page.area[slot] != 0 && frontal(i) && points_.kinds[i] == 0 &&
        sameSide(page.normal[slot], i)) {
        // The pixels around stand for this vertex' share of the surface already.
        work.area -= compact::areaUnits(page.area[slot]);
        page.area[slot] = 0;
    }
}

/// A vertex in view that is no pixel's nearest (the map is denser than the view there) learns its
/// depth all the same; its place across the ray stays, or neighbours would gather at pixels.
void Merger::fuseAlongRay(Page& page, std::uint32_t slot, const Candidate& seen, float depth,
                          float pixelSigma, PageWork& work) {
    const float a = std::max(seen.sigma, kTinySigma), b = std::max(pixelSigma, kLeastSigma);
    const float gain = a * a / (a * a + b * b);
    const Eigen::Vector3f old = page.position(slot);
    const Eigen::Vector3f step = (gain * (depth / seen.z - 1.0F)) * (old - points_.translation);
    page.x[slot] += step.x();
    page.y[slot] += step.y();
    page.z[slot] += step.z();
    const float sigma = a * b / std::sqrt(a * a + b * b);
    page.sigma[slot] = compact::Sigma::encode(sigma);
    const std::uint8_t before = page.open[slot];
    page.open[slot] = openBits(before, page.state[slot], sigma);
    work.touched = work.touched || before != 0;
}

void Merger::fusePage(GraphStorage& storage, std::uint32_t which) {
    Page& page = storage.page(seen_.pages[which]);
    prefetchPage(storage, which + 1);
    PageWork& work = work_[which];
    const std::uint32_t first = which * Page::kSize;
    PageFusion fusion;
    fusion.inView = seen_.slotsInView(which);
    fusion.claims = &seen_.claims[first];
    fusion.before = seen_.sigmas(which);
    fusion.firstStays = paper();
    fusion.typedOpenness = options_.typedOpenness;
    fusion.targetResolution = static_cast<float>(options_.targetResolution);
    fuseMatched(points_, page, fusion);
    work.moved = fusion.moved;
    work.area = fusion.area;
    work.touched = fusion.touched;
    if (paper()) {
        return;
    }
    forEachBit(fusion.inView & ~fusion.matched,
               [&](std::uint32_t slot) { passOver(page, slot, first + slot, work); });
    storage.updatePageBounds(seen_.pages[which]);
}

void Merger::deleteSeenThrough(GraphStorage& storage, RiftFinder& rifts, MergeResult& result) {
    const auto touch = [&](VertexId id) {
        rifts.touch(storage.page(GraphStorage::pageOf(id)).block);
    };
    for (const PageWork& work : work_) {
        for (const auto& [a, b] : work.cut) {
            if (storage.removeEdge(a, b)) {
                ++result.deletedEdges;
                touch(a);
                touch(b);
            }
        }
    }
    for (std::size_t i = 0; i < work_.size(); ++i) {
        const std::uint32_t index = seen_.pages[i];
        const std::uint32_t block = storage.page(index).block;
        if (work_[i].doomed != 0 || work_[i].touched) {
            rifts.touch(block);
        }
        touchedBlocks_.push_back(block);
        forEachBit(work_[i].doomed, [&](std::uint32_t slot) {
            const VertexId id = GraphStorage::idOf(index, slot);
            storage.forEachHalfEdge(id, [&](VertexId n, std::uint16_t) {
                ++result.deletedEdges;
                touch(n);
            });
            work_[i].area -= compact::areaUnits(storage.page(index).area[slot]);
            storage.removeVertex(id);
            ++result.deletedVertices;
        });
        if (work_[i].doomed != 0) {
            storage.updatePageBounds(index);
        }
    }
}

/// The pixels of a strip that become vertices, by tiles, so that the vertices of a page lie near
/// each other; and the blocks they lie in.
void Merger::findFresh(const GraphStorage& storage, int strip) {
    FreshStrip& fresh = freshStrips_[static_cast<std::size_t>(strip)];
    fresh.pixels.clear();
    fresh.runs.clear();
    const int top = strip * kTile, bottom = std::min(points_.height, top + kTile);
    for (std::size_t i = points_.index(0, top); i < points_.index(0, bottom); ++i) {
        const std::uint32_t match = seen_.matchOf[i];
        vertexOf_[i] = match == Association::kNone ? kNoVertex : seen_.idOf(match);
        isFresh_[i] = match == Association::kNone && points_.z[i] > 0 ? 1 : 0;
    }
    GraphStorage::Cube cube;
    for (int left = 0; left < points_.width; left += kTile) {
        const int right = std::min(points_.width, left + kTile);
        for (int r = top; r < bottom; ++r) {
            for (int c = left; c < right; ++c) {
                const std::size_t i = points_.index(c, r);
                if (isFresh_[i] == 0) {
                    continue;
                }
                const Eigen::Vector3f p = points_.inMap(c, r);
                const std::int32_t level = storage.levelOf(points_.z[i] * points_.footprint);
                if (fresh.runs.empty() || cube.key[3] != level || !cube.surelyHolds(p)) {
                    cube = storage.cubeOf(p, level);
                }
                if (fresh.runs.empty() || fresh.runs.back().first != cube.key) {
                    fresh.runs.emplace_back(cube.key, 0U);
                }
                ++fresh.runs.back().second;
                fresh.pixels.push_back(static_cast<std::uint32_t>(i));
            }
        }
    }
}

/// Edges to neighbours that are new, too: right, below, left, above. Each new vertex is one pixel.
/// Returns how many of them lead right or below.
std::size_t Merger::connectFresh(Page& page, std::uint32_t slot, std::size_t i) const {
    const auto w = static_cast<std::size_t>(points_.width);
    page.neighbour[slot].fill(kNoVertex);
    page.weight[slot].fill(0);
    std::size_t n = 0;
    const auto connect = [&](std::size_t j, std::uint16_t code) {
        if (code != ViewPoints::kNoEdge && isFresh_[j] != 0) {
            page.neighbour[slot][n] = vertexOf_[j];
            page.weight[slot][n] = code;
            ++n;
        }
    };
    connect(i + 1, points_.right[i]);
    connect(i + w, points_.down[i]);
    const std::size_t mine = n;
    if (i % w > 0) {
        connect(i - 1, points_.right[i - 1]);
    }
    if (i >= w) {
        connect(i - w, points_.down[i - w]);
    }
    return mine;
}

/// Writes the new vertices of a strip; all of `vertexOf_` must be known.
void Merger::fillFresh(GraphStorage& storage, FreshStrip& strip) {
    strip.edges = 0;
    strip.area = 0;
    strip.toFit.clear();
    const auto w = static_cast<std::uint32_t>(points_.width);
    for (const std::uint32_t pixel : strip.pixels) {
        const VertexId id = vertexOf_[pixel];
        const int column = static_cast<int>(pixel % w), row = static_cast<int>(pixel / w);
        Page& page = storage.page(GraphStorage::pageOf(id));
        const std::uint32_t slot = GraphStorage::slotOf(id);
        const Eigen::Vector3f p = points_.inMap(column, row);
        page.x[slot] = p.x();
        page.y[slot] = p.y();
        page.z[slot] = p.z();
        page.sigma[slot] = compact::Sigma::encode(std::max(points_.sigma[pixel], kLeastSigma));
        page.area[slot] = compact::Area::encode(points_.area[pixel]);
        strip.area += compact::areaUnits(page.area[slot]);
        const std::uint32_t look = points_.look[pixel];
        page.rgb[slot] = {static_cast<std::uint8_t>(look), static_cast<std::uint8_t>(look >> 8U),
                          static_cast<std::uint8_t>(look >> 16U)};
        const bool fine = points_.spacing(pixel) <= static_cast<float>(options_.targetResolution);
        page.state[slot] = static_cast<std::uint8_t>((points_.kinds[pixel] == 0 ? kSurrounded : 0) |
                                                     (fine ? kFineEnough : 0));
        page.open[slot] = openBits(points_.kinds[pixel], page.state[slot],
                                   compact::Sigma::decode(page.sigma[slot]));
        const bool noisy = points_.sigma[pixel] > kNoisy * points_.z[pixel] * points_.footprint;
        if (!paper() && noisy && points_.onPatch(column, row)) {
            page.normal[slot] =
                compact::encodeDirection(points_.rotation * points_.patch(column, row).normal);
        } else {
            strip.toFit.push_back(id);  // once it has its edges
        }
        strip.edges += connectFresh(page, slot, pixel);
    }
}

void Merger::grow(GraphStorage& storage, MergeResult& result) {
    const std::size_t n = points_.z.size();
    const std::size_t behind = static_cast<std::size_t>(points_.width) + kEdgePadding;
    vertexOf_.resize(n + behind, kNoVertex);
    isFresh_.resize(n + behind, 0);
    freshStrips_.resize(static_cast<std::size_t>((points_.height + kTile - 1) / kTile));
    forEach(freshStrips_.size(), 2,
            [&](std::size_t strip) { findFresh(storage, static_cast<int>(strip)); });
    freshIds_.clear();
    for (FreshStrip& strip : freshStrips_) {  // ids one after the other
        strip.first = freshIds_.size();
        for (const auto& [key, count] : strip.runs) {
            const std::uint32_t block = storage.blockAt(key);
            touchedBlocks_.push_back(block);
            storage.addVertices(block, count, freshIds_);
        }
    }
    forEach(freshStrips_.size(), 2, [&](std::size_t s) {
        const FreshStrip& strip = freshStrips_[s];
        for (std::size_t f = 0; f < strip.pixels.size(); ++f) {
            vertexOf_[strip.pixels[f]] = freshIds_[strip.first + f];
        }
    });
    forEach(freshStrips_.size(), 1,
            [&](std::size_t strip) { fillFresh(storage, freshStrips_[strip]); });
    for (const FreshStrip& strip : freshStrips_) {
        storage.countEdges(strip.edges);
        result.newEdges += strip.edges;
    }
    result.newVertices = freshIds_.size();
}

void Merger::refreshNormals(GraphStorage& storage) {
    const auto fit = [&](VertexId id) {
        storage.page(GraphStorage::pageOf(id)).normal[GraphStorage::slotOf(id)] =
            compact::encodeDirection(planeNormal(storage, id, points_.translation, paper()));
    };
    forEach(freshStrips_.size(), 1, [&](std::size_t strip) {
        std::for_each(freshStrips_[strip].toFit.begin(), freshStrips_[strip].toFit.end(), fit);
    });
    forEach(work_.size(), kPagesAtOnce, [&](std::size_t i) {
        const std::uint32_t index = seen_.pages[i];
        forEachBit(work_[i].moved & storage.page(index).alive,
                   [&](std::uint32_t slot) { fit(GraphStorage::idOf(index, slot)); });
    });
    if (paper()) {  // positions stay, but neighbours were added
        std::vector<VertexId> ends;
        for (const auto& strip : missingEdges_) {
            for (const NewEdge& e : strip) {
                ends.push_back(e.a);
                ends.push_back(e.b);
            }
        }
        std::sort(ends.begin(), ends.end());
        ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
        forEach(ends.size(), 512, [&](std::size_t i) { fit(ends[i]); });
    }
}

void Merger::finish(GraphStorage& storage, RiftFinder& rifts, std::int64_t& area) {
    for (const PageWork& work : work_) {
        area += work.area;
    }
    for (const FreshStrip& strip : freshStrips_) {
        area += strip.area;
    }
    freshPages_.clear();
    for (const VertexId id : freshIds_) {
        const std::uint32_t index = GraphStorage::pageOf(id);
        if (freshPages_.empty() || freshPages_.back() != index) {
            freshPages_.push_back(index);
            rifts.touch(storage.page(index).block);
        }
    }
    for (const auto& strip : missingEdges_) {
        for (const NewEdge& e : strip) {
            rifts.touch(storage.page(GraphStorage::pageOf(e.a)).block);
            rifts.touch(storage.page(GraphStorage::pageOf(e.b)).block);
        }
    }
    std::sort(freshPages_.begin(), freshPages_.end());
    freshPages_.erase(std::unique(freshPages_.begin(), freshPages_.end()), freshPages_.end());
    forEach(freshPages_.size(), kPagesAtOnce,
            [&](std::size_t i) { storage.updatePageBounds(freshPages_[i]); });
    std::sort(touchedBlocks_.begin(), touchedBlocks_.end());
    touchedBlocks_.erase(std::unique(touchedBlocks_.begin(), touchedBlocks_.end()),
                         touchedBlocks_.end());
    for (const std::uint32_t block : touchedBlocks_) {
        storage.updateBlockBounds(block);
    }
}

std::size_t Merger::memoryBytes() const {
    std::size_t bytes = points_.memoryBytes() + seen_.memoryBytes() + bytesOf(work_) +
                        bytesOf(vertexOf_) + bytesOf(freshIds_) + bytesOf(isFresh_) +
                        bytesOf(touchedBlocks_) + bytesOf(freshPages_);
    for (const FreshStrip& strip : freshStrips_) {
        bytes += bytesOf(strip.pixels) + bytesOf(strip.runs) + bytesOf(strip.toFit);
    }
    for (const auto& strip : missingEdges_) {
        bytes += bytesOf(strip);
    }
    return bytes;
}

}  // namespace riftmap
