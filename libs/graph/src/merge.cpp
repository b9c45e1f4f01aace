// SPDX-License-Identifier: BSD-3-Clause
#include "merge.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>

#include "normals.h"
#include "riftmap/core/parallel.h"
#include "visibility.h"

namespace riftmap {
namespace {

constexpr float kTinySigma = 1e-6F;   // [m]
constexpr float kLeastSigma = 1e-4F;  // [m] nothing is known better than this by one view
constexpr float kNoiseFactor = 3.0F;  // standard deviations
constexpr float kNoisy = 0.25F;       // sigma per spacing above which normals come from patches
constexpr unsigned kDeletingEvidence = 2;    // views
constexpr std::uint32_t kWellConnected = 4;  // edges of a pixel
constexpr std::uint32_t kMostEdges = 9;      // what fits without a second chunk
constexpr std::uint32_t kPagesAtOnce = 16;
constexpr int kRowsAtOnce = 8;
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

/// f(i) for each i of [0, n), `atOnce` in one go.
template <class F>
void forEach(std::size_t n, std::size_t atOnce, F&& f) {
    parallelFor(n, atOnce, [&f](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i) {
            f(i);
        }
    });
}

std::array<std::uint8_t, 3> colourAt(const cv::Mat& image, std::uint32_t pixel, int width) {
    if (image.empty()) {
        return {128, 128, 128};
    }
    const auto w = static_cast<std::uint32_t>(width);
    const std::uint8_t* row = image.ptr<std::uint8_t>(static_cast<int>(pixel / w));
    const std::size_t column = pixel % w;
    if (image.channels() == 1) {
        return {row[column], row[column], row[column]};
    }
    return {row[3 * column + 2], row[3 * column + 1], row[3 * column]};
}

unsigned evidenceOf(std::uint8_t state) {
    return (state & kEvidenceMask) >> kEvidenceShift;
}
std::uint8_t withEvidence(std::uint8_t state, unsigned evidence) {
    return static_cast<std::uint8_t>((state & ~kEvidenceMask) |
                                     (std::min(evidence, 7U) << kEvidenceShift));
}

/// Lowers the weight code stored at `slot`; safe while others do the same. True if it changed.
bool lower(std::uint16_t& slot, std::uint16_t code) {
    std::atomic_ref<std::uint16_t> ref(slot);
    std::uint16_t old = ref.load(std::memory_order_relaxed);
    for (;;) {
        const std::uint16_t smaller = compact::smallerWeight(old, code);
        if (smaller == old) {
            return false;
        }
        if (ref.compare_exchange_weak(old, smaller, std::memory_order_relaxed)) {
            return true;
        }
    }
}

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
            [&](std::size_t i) { fusePage(view, storage, static_cast<std::uint32_t>(i)); });
    deleteSeenThrough(storage, rifts, result);
    times_.fuse = watch.lap();

    grow(view, storage, result);
    times_.grow = watch.lap();
    connectNew(storage, result);
    connectMatched(storage, result);
    times_.edges = watch.lap();
    refreshNormals(storage);
    finish(storage, rifts, area);
    times_.normals = watch.lap();

    result.rawPoints = points_.validCount;
    result.matched = seen_.matched;
    return result;
}

void Merger::findSeenThroughEdges(const GraphStorage& storage, std::uint32_t which) {
    const std::uint32_t index = seen_.pages[which];
    const Page& page = storage.page(index);
    const auto inCamera = [this](const Eigen::Vector3f& p) -> Eigen::Vector3f {
        return points_.rotation.transpose() * (p - points_.translation);
    };
    forEachBit(page.alive, [&](std::uint32_t slot) {
        if (!page.mayHaveHighEdge(slot) || !(seen_.candidates[which * Page::kSize + slot].z > 0)) {
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

std::uint8_t Merger::openBits(std::uint8_t kinds, std::uint8_t state, float sigma) const {
    unsigned bits = (state & kSurrounded) != 0 ? 0U : kinds & ~unsigned{kTooCoarse};
    const auto target = static_cast<float>(options_.targetResolution);
    if (options_.typedOpenness && ((state & kFineEnough) == 0 || 2 * sigma > target)) {
        bits |= kTooCoarse;
    }
    return static_cast<std::uint8_t>(bits);
}

void Merger::fuse(const View& view, Page& page, std::uint32_t slot, std::uint32_t candidate,
                  PageWork& work) {
    const std::uint32_t pixel = seen_.bestPixel(candidate);
    const auto w = static_cast<std::uint32_t>(points_.width);
    const int column = static_cast<int>(pixel % w), row = static_cast<int>(pixel / w);
    float sigma = compact::Sigma::decode(page.sigma[slot]);
    if (!paper()) {
        // One observation a view, however many pixels matched: their errors are not independent.
        const float a = std::max(sigma, kTinySigma),
                    b = std::max(points_.sigma[pixel], kLeastSigma);
        const float gain = a * a / (a * a + b * b);
        const Eigen::Vector3f old = page.position(slot);
        const Eigen::Vector3f step = gain * (points_.inMap(column, row) - old);
        page.x[slot] += step.x();
        page.y[slot] += step.y();
        page.z[slot] += step.z();
        sigma = a * b / std::sqrt(a * a + b * b);
        page.sigma[slot] = compact::Sigma::encode(sigma);
        const auto colour = colourAt(view.image, pixel, points_.width);
        for (std::size_t i = 0; i < 3; ++i) {
            const float before = page.rgb[slot][i];
            page.rgb[slot][i] = static_cast<std::uint8_t>(
                compact::roundNearest(before + gain * (static_cast<float>(colour[i]) - before)));
        }
        const float spacing = points_.z[pixel] * points_.footprint;
        if (points_.sigma[pixel] > kNoisy * spacing) {
            if (points_.onPatch(column, row)) {
                const Eigen::Vector3f normal =
                    (1 - gain) * compact::decodeDirection(page.normal[slot]) +
                    gain * (points_.rotation * points_.patch(column, row).normal);
                page.normal[slot] = compact::encodeDirection(normal);
            }
        } else if (step.norm() > 0.02F * spacing) {
            work.moved |= std::uint64_t{1} << slot;
        }
    }
    const std::uint8_t flags = seen_.flags[candidate];
    std::uint8_t& state = page.state[slot];
    state = static_cast<std::uint8_t>(
        state | ((flags & Association::kSomeSurrounded) != 0 ? kSurrounded : 0) |
        ((flags & Association::kSomeFine) != 0 ? kFineEnough : 0));
    const unsigned evidence = evidenceOf(state);
    state = withEvidence(state, evidence > 0 ? evidence - 1 : 0);
    // Reasons that both views give are better than those of one; else the newer view knows.
    const unsigned before = page.open[slot] & ~unsigned{kTooCoarse};
    const unsigned now = points_.kinds[pixel];
    const std::uint8_t open =
        openBits(static_cast<std::uint8_t>((before & now) != 0 ? before & now : now), state, sigma);
    work.touched = work.touched || open != 0 || page.open[slot] != 0;
    page.open[slot] = open;
    // The pixels of a vertex are its share of the surface, where none of them is cut off.
    if (frontal(pixel) && (flags & Association::kSomeSurrounded) != 0 &&
        (flags & Association::kSomeOpen) == 0) {
        const float area = static_cast<float>(seen_.areaOf[candidate]) * Association::kAreaUnit;
        const std::uint16_t code = compact::Area::encode(area);
        work.area += compact::areaUnits(code) - compact::areaUnits(page.area[slot]);
        page.area[slot] = code;
    }
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
    const Candidate& seen = seen_.candidates[candidate];
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
    fuseAlongRay(page, slot, seen, depth, points_.sigma[i], work);
    if (frontal(i) && points_.kinds[i] == 0 && page.area[slot] != 0) {
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

void Merger::fusePage(const View& view, GraphStorage& storage, std::uint32_t which) {
    Page& page = storage.page(seen_.pages[which]);
    PageWork& work = work_[which];
    forEachBit(page.alive, [&](std::uint32_t slot) {  // the pixels lie apart in memory
        const std::uint32_t pixel = seen_.bestPixel(which * Page::kSize + slot);
        if (pixel != Association::kNone) {
            __builtin_prefetch(&points_.z[pixel]);
            __builtin_prefetch(&points_.sigma[pixel]);
            __builtin_prefetch(&points_.disparity[pixel]);
            __builtin_prefetch(&points_.kinds[pixel]);
            if (!view.image.empty()) {
                __builtin_prefetch(view.image.data + pixel * view.image.elemSize());
            }
        }
    });
    forEachBit(page.alive, [&](std::uint32_t slot) {
        const std::uint32_t candidate = which * Page::kSize + slot;
        if (!(seen_.candidates[candidate].z > 0)) {
            return;
        }
        if (seen_.bestPixel(candidate) != Association::kNone) {
            fuse(view, page, slot, candidate, work);
        } else if (!paper()) {
            passOver(page, slot, candidate, work);
        }
    });
    if (!paper()) {
        storage.updatePageBounds(seen_.pages[which]);
    }
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

void Merger::grow(const View& view, GraphStorage& storage, MergeResult& result) {
    const std::size_t n = points_.z.size();
    vertexOf_.resize(n);
    isFresh_.assign(n, 0);
    fresh_.clear();
    forEach(n, 4096, [&](std::size_t i) {
        vertexOf_[i] =
            seen_.matchOf[i] == Association::kNone ? kNoVertex : seen_.idOf(seen_.matchOf[i]);
    });
    // Ids by tiles, so that the vertices of a page lie near each other.
    std::array<std::int32_t, 3> lastKey{};
    std::uint32_t block = GraphStorage::kNoBlock;
    for (int tr = 0; tr < points_.height; tr += kTile) {
        for (int tc = 0; tc < points_.width; tc += kTile) {
            for (int r = tr; r < std::min(points_.height, tr + kTile); ++r) {
                for (int c = tc; c < std::min(points_.width, tc + kTile); ++c) {
                    const std::size_t i = points_.index(c, r);
                    if (!(points_.z[i] > 0) || vertexOf_[i] != kNoVertex) {
                        continue;
                    }
                    const auto key = storage.keyOf(points_.inMap(c, r));
                    if (block == GraphStorage::kNoBlock || key != lastKey) {
                        block = storage.blockAt(key);
                        lastKey = key;
                        touchedBlocks_.push_back(block);
                    }
                    vertexOf_[i] = storage.addVertex(block);
                    isFresh_[i] = 1;
                    fresh_.push_back(static_cast<std::uint32_t>(i));
                }
            }
        }
    }
    forEach(fresh_.size(), 512, [&](std::size_t f) {
        const std::uint32_t pixel = fresh_[f];
        const auto w = static_cast<std::uint32_t>(points_.width);
        const int column = static_cast<int>(pixel % w), row = static_cast<int>(pixel / w);
        const VertexId id = vertexOf_[pixel];
        Page& page = storage.page(GraphStorage::pageOf(id));
        const std::uint32_t slot = GraphStorage::slotOf(id);
        const Eigen::Vector3f p = points_.inMap(column, row);
        page.x[slot] = p.x();
        page.y[slot] = p.y();
        page.z[slot] = p.z();
        page.sigma[slot] = compact::Sigma::encode(std::max(points_.sigma[pixel], kLeastSigma));
        page.area[slot] = compact::Area::encode(points_.area[pixel]);
        page.rgb[slot] = colourAt(view.image, pixel, points_.width);
        const bool fine = points_.spacing(pixel) <= static_cast<float>(options_.targetResolution);
        page.state[slot] = static_cast<std::uint8_t>((points_.kinds[pixel] == 0 ? kSurrounded : 0) |
                                                     (fine ? kFineEnough : 0));
        page.open[slot] = openBits(points_.kinds[pixel], page.state[slot],
                                   compact::Sigma::decode(page.sigma[slot]));
    });
    result.newVertices = fresh_.size();
}

void Merger::connectNew(GraphStorage& storage, MergeResult& result) {
    // Each new vertex is one pixel and writes its own half-edges to other new ones.
    std::atomic<std::size_t> added{0};
    const auto w = static_cast<std::size_t>(points_.width);
    forEach(fresh_.size(), 1024, [&](std::size_t f) {
        const std::size_t i = fresh_[f];
        const VertexId id = vertexOf_[i];
        const auto connect = [&](std::size_t j, std::uint16_t code) {
            if (code != ViewPoints::kNoEdge && isFresh_[j] != 0) {
                storage.appendInline(id, vertexOf_[j], code);
                return true;
            }
            return false;
        };
        std::size_t mine = 0;
        mine += connect(i + 1, points_.right[i]) ? 1U : 0U;
        mine += connect(i + w, points_.down[i]) ? 1U : 0U;
        if (i % w > 0) {
            connect(i - 1, points_.right[i - 1]);
        }
        if (i >= w) {
            connect(i - w, points_.down[i - w]);
        }
        added.fetch_add(mine, std::memory_order_relaxed);
    });
    storage.countEdges(added.load());
    result.newEdges += added.load();
}

bool Merger::wanted(const GraphStorage& storage, VertexId a, VertexId b, std::uint16_t code) const {
    if (paper()) {
        return true;
    }
    // Between two vertices that have their four neighbours each, a further low edge says nothing.
    const std::uint32_t da = storage.degree(a), db = storage.degree(b);
    if (da >= kMostEdges || db >= kMostEdges) {
        return false;
    }
    return (code & compact::kHighBit) != 0 || da < kWellConnected || db < kWellConnected;
}

void Merger::connectMatched(GraphStorage& storage, MergeResult& result) {
    const std::size_t strips =
        (static_cast<std::size_t>(points_.height) + kRowsAtOnce - 1) / kRowsAtOnce;
    wantedEdges_.resize(strips);
    forEach(strips, 1, [&](std::size_t strip) {
        auto& list = wantedEdges_[strip];
        list.clear();
        const auto connect = [&](std::size_t i, std::size_t j, std::uint16_t code) {
            if (code == ViewPoints::kNoEdge || (isFresh_[i] != 0 && isFresh_[j] != 0)) {
                return;
            }
            const VertexId a = vertexOf_[i], b = vertexOf_[j];
            if (a == b) {
                return;
            }
            if (std::uint16_t* there = storage.findHalfEdge(a, b)) {
                if (lower(*there, code)) {
                    lower(*storage.findHalfEdge(b, a), code);
                }
            } else if (wanted(storage, a, b, code)) {
                list.push_back({a, b, code});
            }
        };
        const int first = static_cast<int>(strip) * kRowsAtOnce;
        for (int r = first; r < std::min(points_.height, first + kRowsAtOnce); ++r) {
            for (int c = 0; c < points_.width; ++c) {
                const std::size_t i = points_.index(c, r);
                connect(i, i + 1, points_.right[i]);
                connect(i, i + static_cast<std::size_t>(points_.width), points_.down[i]);
            }
        }
    });
    for (const auto& list : wantedEdges_) {
        for (const NewEdge& e : list) {
            if (std::uint16_t* there = storage.findHalfEdge(e.a, e.b)) {
                lower(*there, e.code);
                lower(*storage.findHalfEdge(e.b, e.a), e.code);
            } else if (wanted(storage, e.a, e.b, e.code)) {
                storage.addEdge(e.a, e.b, e.code);
                ++result.newEdges;
            }
        }
    }
}

void Merger::refreshNormals(GraphStorage& storage) {
    const auto fit = [&](VertexId id) {
        storage.page(GraphStorage::pageOf(id)).normal[GraphStorage::slotOf(id)] =
            compact::encodeDirection(planeNormal(storage, id, points_.translation, paper()));
    };
    forEach(fresh_.size(), 512, [&](std::size_t f) {
        const std::uint32_t pixel = fresh_[f];
        const auto w = static_cast<std::uint32_t>(points_.width);
        const int column = static_cast<int>(pixel % w), row = static_cast<int>(pixel / w);
        const bool noisy = points_.sigma[pixel] > kNoisy * points_.z[pixel] * points_.footprint;
        const VertexId id = vertexOf_[pixel];
        if (!paper() && noisy && points_.onPatch(column, row)) {
            storage.page(GraphStorage::pageOf(id)).normal[GraphStorage::slotOf(id)] =
                compact::encodeDirection(points_.rotation * points_.patch(column, row).normal);
        } else {
            fit(id);
        }
    });
    forEach(work_.size(), kPagesAtOnce, [&](std::size_t i) {
        const std::uint32_t index = seen_.pages[i];
        forEachBit(work_[i].moved & storage.page(index).alive,
                   [&](std::uint32_t slot) { fit(GraphStorage::idOf(index, slot)); });
    });
    if (paper()) {  // positions stay, but neighbours were added
        std::vector<VertexId> ends;
        for (const auto& list : wantedEdges_) {
            for (const NewEdge& e : list) {
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
    freshPages_.clear();
    for (const std::uint32_t pixel : fresh_) {
        const std::uint32_t index = GraphStorage::pageOf(vertexOf_[pixel]);
        const Page& page = storage.page(index);
        area += compact::areaUnits(page.area[GraphStorage::slotOf(vertexOf_[pixel])]);
        if (freshPages_.empty() || freshPages_.back() != index) {
            freshPages_.push_back(index);
            rifts.touch(page.block);
        }
    }
    for (const auto& list : wantedEdges_) {
        for (const NewEdge& e : list) {
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
    const std::size_t pixels = points_.z.capacity();
    const std::size_t candidates = seen_.candidates.capacity();
    return pixels * (3 * sizeof(float) + 2 * sizeof(std::uint16_t) + 2 + 5 * sizeof(VertexId)) +
           points_.patches.capacity() * sizeof(PatchPlane) +
           candidates * (sizeof(Candidate) + sizeof(std::uint64_t) + 1 + 2 * sizeof(VertexId)) +
           work_.capacity() * sizeof(PageWork);
}

}  // namespace riftmap
