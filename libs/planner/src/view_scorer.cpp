// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/view_scorer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "riftmap/core/parallel.h"
#include "square_kernel.h"

namespace riftmap {

namespace {

constexpr int kPixels = 12;  ///< of the image to one of the depth buffer, along each axis
constexpr int kRayStride = 2;
constexpr double kMargin = 6;  ///< [px] a tear at the very border of the image stays torn
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr float kNearest = 0.05F;  ///< [m] before the camera: nothing nearer is drawn

}  // namespace

struct ViewScorer::DepthBuffer {
    int width = 0, height = 0;
    float fx = 0, fy = 0, cx = 0, cy = 0;  ///< [px of the buffer]
    std::vector<float> depth;

    float& at(int column, int row) {
        return depth[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                     static_cast<std::size_t>(column)];
    }
    float at(int column, int row) const {
        return depth[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                     static_cast<std::size_t>(column)];
    }
    SquareCamera squares(const Pose& camera_T_world, float half, double farLimit) const;
};

/// What squares are drawn with into this buffer; half their edge in metres.
SquareCamera ViewScorer::DepthBuffer::squares(const Pose& camera_T_world, float half,
                                              double farLimit) const {
    SquareCamera c;
    c.rotation = camera_T_world.rotation.cast<float>();
    c.translation = camera_T_world.translation.cast<float>();
    c.fx = fx;
    c.fy = fy;
    c.cx = cx;
    c.cy = cy;
    c.half = half;
    c.nearest = kNearest;
    c.farthest = static_cast<float>(farLimit);
    c.width = width;
    c.height = height;
    return c;
}

struct ViewScorer::Drawing {
    Pose world_T_camera;
    DepthBuffer buffer;
    std::vector<const BlockView*> seen;  ///< those in sight, in the blocks' own order
};

namespace {

/// Collects places and draws squares around them, so many at a time; all are drawn once finish()
/// was called.
class SquareDrawer {
 public:
    SquareDrawer(const SquareCamera& camera, std::vector<float>& depth)
        : camera_(camera), depth_(&depth) {}

    void add(const Eigen::Matrix<float, Eigen::Dynamic, 3>& places) {
        for (Eigen::Index begin = 0; begin < places.rows();) {
            const auto room = static_cast<Eigen::Index>(SquareBatch::kMost - batch_.count);
            const Eigen::Index n = std::min(room, places.rows() - begin);
            const auto put = [&](int axis, std::array<float, SquareBatch::kMost>& to) {
                std::copy_n(places.col(axis).data() + begin, n, to.data() + batch_.count);
            };
            put(0, batch_.x);
            put(1, batch_.y);
            put(2, batch_.z);
            batch_.count += static_cast<std::size_t>(n);
            begin += n;
            if (batch_.count == SquareBatch::kMost) {
                finish();
            }
        }
    }
    void finish() {
        drawSquares(camera_, batch_, depth_->data());
        batch_.count = 0;
    }

 private:
    SquareCamera camera_;
    SquareBatch batch_;
    std::vector<float>* depth_;
};

}  // namespace

ViewScorer::ViewScorer(const SensorModel& sensor, const SurfaceSummary& summary,
                       const RiftLedger& ledger, const FreeSpace& space, double resolution,
                       const Weights& weights)
    : sensor_(sensor),
      summary_(&summary),
      space_(&space),
      ledger_(&ledger),
      weights_(weights),
      resolution_(resolution),
      goodDepth_(sensor.goodDepth(resolution)) {
    for (const auto& [key, block] : summary.blocks()) {
        BlockView b{block.box.center().cast<float>(),
                    static_cast<float>(block.box.diagonal().norm() / 2), &block, open_.size(), 0};
        for (const RiftRecord* record : ledger.inBlock(key)) {
            if (record->state == RiftState::kOpen) {
                open_.push_back(record);
            }
        }
        b.lastOpen = open_.size();
        blocks_.push_back(b);
    }
    groupBlocks();
    openCells_.resize(open_.size());
    parallelForEach(open_.size(), 256, [&](std::size_t i) {
        const SurfaceCell& cell = open_[i]->cell;
        openCells_[i] = {cell.openPosition,
                         cell.hidden > 0 ? cell.hiddenPosition : cell.openPosition,
                         leftAfterTries(*open_[i])};
    });
}

void ViewScorer::groupBlocks() {
    constexpr float kBlocks = 4;  // of a group, along each axis
    std::map<std::array<int, 3>, std::size_t> index;
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
        const Eigen::AlignedBox3f box = blocks_[i].block->box.cast<float>();
        const Eigen::Vector3i at =
            (blocks_[i].centre / (kBlocks * box.sizes().x())).array().floor().cast<int>();
        const auto [it, isNew] = index.try_emplace({at.x(), at.y(), at.z()}, groups_.size());
        if (isNew) {
            groups_.emplace_back();
        }
        Group& group = groups_[it->second];
        group.box.extend(box);
        group.blocks.push_back(static_cast<std::uint32_t>(i));
    }
}

double ViewScorer::leftAfterTries(const RiftRecord& record) const {
    const bool unmatched = (record.cell.kinds & kNoMatch) != 0;
    const double worth = weights_.byExperience ? ledger_->tryWorth(record) : 1.0;
    return worth *
           std::pow(unmatched ? weights_.vainUnmatched : weights_.vain, record.attempts.size());
}

/// What surface that is new is worth if it is seen from so far. One view is not accurate enough
/// beyond the good depth, but covers much, and the views after it may make it better.
double ViewScorer::newSurfaceShare(double distance) const {
    const double full = weights_.newSurfaceDepth * goodDepth_;
    if (full <= 0) {
        return sensor_.shareWithin(resolution_, distance);
    }
    return distance <= full ? 1.0 : std::pow(full / distance, 2);
}

/// What is uncovered along rims that seem to hide nothing, on average [m^2].
double ViewScorer::besideRim(const SurfaceCell& cell) const {
    constexpr double kWidth = 3e-4;  // [m]
    return kWidth * static_cast<double>(cell.rim);
}

/// Whether nothing before what the cell hides (gapsByLine; else nothing close before it) is in the
/// way of the cameras: of both, but for exact depth, which needs no partner.
bool ViewScorer::openTo(const SurfaceCell& cell, const Pose& world_T_camera) const {
    constexpr float kClose = 4;  // [cells]
    const float reach = weights_.gapsByLine ? kFar : kClose;
    const auto open = [&](const Eigen::Vector3d& eye) {
        return summary_->openTowards(cell.hiddenPosition, eye.cast<float>(), reach);
    };
    return open(world_T_camera.translation) &&
           (sensor_.exactDepth() ||
            open(world_T_camera * Eigen::Vector3d(sensor_.camera.baseline, 0, 0)));
}

ViewScorer::Benefit ViewScorer::benefit(const RiftRecord& record,
                                        const Pose& world_T_camera) const {
    return benefit(record, leftAfterTries(record), world_T_camera, true);
}

ViewScorer::Benefit ViewScorer::benefit(const RiftRecord& record, double vain,
                                        const Pose& world_T_camera, bool withLines) const {
    const Eigen::Vector3d& eye = world_T_camera.translation;
    if (RiftLedger::tried(record, eye)) {
        return {};
    }
    const Eigen::Vector3d ray = eye - record.cell.openPosition.cast<double>();
    const double distance = ray.norm();
    const auto angleTo = [&](const Eigen::Vector3d& facing) {
        constexpr double kClear = 0.3;  // a shorter mean is of normals that cancel: any side may do
        return facing.norm() > kClear ? ray.dot(facing.normalized()) / distance : 0.6;
    };
    const auto qualityOn = [&](const Eigen::Vector3d& facing) {
        const double angle = angleTo(facing);
        // Matching is worse at flat angles.
        return sensor_.matched() ? std::clamp((angle - 0.2) / 0.35, 0.0, 1.0)
                                 : std::clamp((angle - 0.15) / 0.1, 0.0, 1.0);
    };
    // What a gap hides faces as the gap does. At other silhouettes the surface bends away over the
    // rim: what is to be seen faces outwards too, the more so if views from where the rim's own
    // surface is seen well were in vain.
    Eigen::Vector3d facing = record.cell.openNormal.cast<double>();
    if ((record.cell.kinds & kDepthStep) != 0) {
        const double over = 0.7 * (1.0 + static_cast<double>(record.attempts.size()));
        facing += over * record.cell.outward.cast<double>();
    }
    const double coarseQuality = qualityOn(facing);
    double tornQuality = coarseQuality;
    if (record.cell.hidden > 0) {
        const Eigen::Vector3d hidden = record.cell.hiddenNormal.cast<double>();
        // Along open lines about so much of what the dragon's gaps hid was seen.
        const bool hint = weights_.gapsByLine && !sensor_.matched();
        tornQuality = hint ? 0.5 * (1 + angleTo(hidden)) : qualityOn(hidden);
        if (withLines && tornQuality > 0 && !openTo(record.cell, world_T_camera)) {
            tornQuality = 0;
        }
    }
    // New surface is worth something from afar too; known surface gets better only from where the
    // view measures well.
    const double torn = newSurfaceShare(distance);
    const double coarse = std::clamp((1.6 * goodDepth_ - distance) / (0.6 * goodDepth_), 0.0, 1.0);
    const double tornArea =
        weights_.hidden * static_cast<double>(record.cell.hidden) + besideRim(record.cell);
    const double coarseArea = weights_.coarse * static_cast<double>(record.cell.coarse);
    Benefit result;
    result.torn = tornQuality * vain * torn;
    result.coarse = coarseQuality * vain * coarse;
    result.coarseArea = result.coarse * coarseArea;
    result.area = result.torn * tornArea + result.coarseArea;
    result.quality = result.torn * tornArea > 0.3 * result.coarseArea ? tornQuality * torn
                                                                      : coarseQuality * coarse;
    return result;
}

std::shared_ptr<const ViewScorer::Drawing> ViewScorer::draw(const Pose& world_T_camera) const {
    const StereoCamera& c = sensor_.camera;
    const auto drawing = std::make_shared<Drawing>();
    drawing->world_T_camera = world_T_camera;
    DepthBuffer& b = drawing->buffer;
    std::vector<const BlockView*>& seen = drawing->seen;
    b.width = std::max(1, c.width / kPixels);
    b.height = std::max(1, c.height / kPixels);
    b.fx = static_cast<float>(c.fx / kPixels);
    b.fy = static_cast<float>(c.fy / kPixels);
    b.cx = static_cast<float>((c.cx + 0.5) / kPixels - 0.5);
    b.cy = static_cast<float>((c.cy + 0.5) / kPixels - 0.5);
    b.depth.assign(static_cast<std::size_t>(b.width) * static_cast<std::size_t>(b.height), kFar);
    const Pose camera_T_world = world_T_camera.inverse();
    const Eigen::Matrix3f rotation = camera_T_world.rotation.cast<float>();
    const Eigen::Vector3f translation = camera_T_world.translation.cast<float>();
    const float half = 0.6F * static_cast<float>(summary_->cellSize());
    const auto farLimit = static_cast<float>(sensor_.farLimit);
    const auto outOfSight = [&](const Eigen::Vector3f& centre, float radius) {
        const Eigen::Vector3f m = rotation * centre + translation;
        const float z = std::max(m.z(), kNearest);
        const float spread = b.fx * radius / z;
        const float u = b.fx * m.x() / z + b.cx;
        const float v = b.fy * m.y() / z + b.cy;
        return m.z() < -radius || m.z() > farLimit + radius ||
               (m.z() > radius &&
                (u < -spread || v < -spread || u > static_cast<float>(b.width) + spread ||
                 v > static_cast<float>(b.height) + spread));
    };
    for (const Group& group : groups_) {
        if (outOfSight(group.box.center(), group.box.diagonal().norm() / 2)) {
            continue;
        }
        for (const std::uint32_t i : group.blocks) {
            if (!outOfSight(blocks_[i].centre, blocks_[i].radius)) {
                seen.push_back(&blocks_[i]);
            }
        }
    }
    std::sort(seen.begin(), seen.end());
    SquareDrawer drawer(b.squares(camera_T_world, half, sensor_.farLimit), b.depth);
    for (const BlockView* block : seen) {
        drawer.add(block->block->positions);
    }
    drawer.finish();
    return drawing;
}

template <class F>
void ViewScorer::forEachUnknown(const Pose& world_T_camera, const DepthBuffer& b, int stride,
                                const F& f) const {
    for (int row = 0; row < b.height; row += stride) {
        for (int column = sensor_.firstColumn / kPixels; column < b.width; column += stride) {
            const Eigen::Vector3d inCamera(
                static_cast<double>((static_cast<float>(column) - b.cx) / b.fx),
                static_cast<double>((static_cast<float>(row) - b.cy) / b.fy), 1.0);
            const double norm = inCamera.norm();
            const double depth = std::min(static_cast<double>(b.at(column, row)), sensor_.farLimit);
            const Eigen::Vector3d direction = world_T_camera.rotation * (inCamera / norm);
            const FreeSpace::UnknownRun run =
                space_->firstUnknown(world_T_camera.translation, direction, depth * norm);
            if (run.begin > 0) {
                // The surface may be anywhere in it.
                f(Eigen::Vector3d(world_T_camera.translation + run.begin * direction),
                  (run.begin + run.end) / (2 * norm));
            }
        }
    }
}

/// Matching makes surface up where all is nearer than its range; other depth only misses it.
double ViewScorer::nearShareOf(const DepthBuffer& buffer) const {
    if (!sensor_.matched()) {
        return 0;
    }
    const int firstColumn = sensor_.firstColumn / kPixels;
    int nearPixels = 0;
    for (int row = 0; row < buffer.height; ++row) {
        for (int column = firstColumn; column < buffer.width; ++column) {
            nearPixels += static_cast<double>(buffer.at(column, row)) < sensor_.nearLimit ? 1 : 0;
        }
    }
    return static_cast<double>(nearPixels) / ((buffer.width - firstColumn) * buffer.height);
}

/// Depth that is drawn where this place is in the image [m]; nothing if it is out of range or of
/// the true field of view.
std::optional<float> ViewScorer::drawnAt(const DepthBuffer& buffer,
                                         const Eigen::Vector3f& inCamera) const {
    const Eigen::Vector3d p = inCamera.cast<double>();
    constexpr auto kLeast = static_cast<double>(kNearest);
    if (p.z() < std::max(1.02 * sensor_.nearLimit, kLeast) || p.z() > sensor_.farLimit) {
        return std::nullopt;
    }
    const StereoCamera& camera = sensor_.camera;
    const Eigen::Vector2d uv = camera.project(p);
    if (uv.x() < sensor_.firstColumn + kMargin || uv.x() > camera.width - 1 - kMargin ||
        uv.y() < kMargin || uv.y() > camera.height - 1 - kMargin) {
        return std::nullopt;
    }
    const int column = std::clamp(static_cast<int>(uv.x()) / kPixels, 0, buffer.width - 1);
    const int row = std::clamp(static_cast<int>(uv.y()) / kPixels, 0, buffer.height - 1);
    return buffer.at(column, row);
}

/// In the image, and nothing drawn more than `slack` before it.
bool ViewScorer::visible(const DepthBuffer& buffer, const Eigen::Vector3f& inCamera,
                         float slack) const {
    const std::optional<float> depth = drawnAt(buffer, inCamera);
    return depth && *depth >= inCamera.z() - slack;
}

ViewScore ViewScorer::estimate(const Drawing& drawing) const {
    return scoreEvery((open_.size() + kMostOpen - 1) / kMostOpen, 2 * kRayStride, drawing);
}

ViewScore ViewScorer::score(const Drawing& drawing) const {
    return scoreEvery(1, kRayStride, drawing);
}

/// Weighs one open cell in `stride` for as many, and one ray in `rayStride` along both axes.
ViewScore ViewScorer::scoreEvery(std::size_t stride, int rayStride, const Drawing& drawing) const {
    stride = std::max<std::size_t>(stride, 1);
    ViewScore result;
    const Pose& world_T_camera = drawing.world_T_camera;
    const Pose camera_T_world = world_T_camera.inverse();
    const DepthBuffer& buffer = drawing.buffer;
    result.nearShare = nearShareOf(buffer);
    const StereoCamera& camera = sensor_.camera;
    const double cell = summary_->cellSize();
    double seenWell = 0;  // [m^2] of openGain
    for (const BlockView* block : drawing.seen) {
        const std::size_t first = (block->firstOpen + stride - 1) / stride * stride;
        for (std::size_t i = first; i < block->lastOpen; i += stride) {
            const Eigen::Vector3f p =
                (camera_T_world * openCells_[i].open.cast<double>()).cast<float>();
            if (!visible(buffer, p, static_cast<float>(2.0 * cell))) {
                continue;
            }
            const RiftRecord& record = *open_[i];
            const Benefit b = benefit(record, openCells_[i].vain, world_T_camera, true);
            if (b.area <= 0) {
                continue;
            }
            result.openGain += static_cast<double>(stride) * b.area;
            result.coarseGain += static_cast<double>(stride) * b.coarseArea;
            const bool well = b.quality > 0.5;
            (well ? result.cells : result.badlySeen).push_back(record.cell.key);
            seenWell += well ? static_cast<double>(stride) * b.area : 0.0;
        }
    }
    std::sort(result.cells.begin(), result.cells.end());
    if (seenWell >= 0.5 * result.openGain) {
        result.badlySeen.clear();
    }
    const double side = static_cast<double>(kPixels * rayStride) / camera.fx;
    forEachUnknown(world_T_camera, buffer, rayStride, [&](const Eigen::Vector3d& p, double depth) {
        result.unknownGain += side * side * depth * depth * newSurfaceShare(depth) *
                              (weights_.byExperience ? space_->lookWorth(p) : 1.0);
    });
    result.unknownGain *= weights_.unknown;
    result.gain = result.openGain + result.unknownGain;
    return result;
}

std::vector<Eigen::Vector3d> ViewScorer::unknownSeen(const Pose& world_T_camera) const {
    std::vector<Eigen::Vector3d> places;
    forEachUnknown(world_T_camera, draw(world_T_camera)->buffer, kRayStride,
                   [&](const Eigen::Vector3d& p, double) { places.push_back(p); });
    return places;
}

void ViewScorer::setFrontier(std::vector<FreeSpace::Frontier> frontier, double edge) {
    frontier_ = std::move(frontier);
    frontierEdge_ = edge;
    frontierCentres_.resize(static_cast<Eigen::Index>(frontier_.size()), 3);
    for (std::size_t i = 0; i < frontier_.size(); ++i) {
        frontierCentres_.row(static_cast<Eigen::Index>(i)) = frontier_[i].centre.transpose();
    }
}

std::vector<float> ViewScorer::worth() const {
    std::vector<float> worth;
    worth.reserve(2 * (open_.size() + frontier_.size()));
    for (const RiftRecord* record : open_) {
        worth.push_back(static_cast<float>(
            weights_.hidden * static_cast<double>(record->cell.hidden) + besideRim(record->cell)));
        worth.push_back(static_cast<float>(weights_.doubt) * record->cell.doubt);
    }
    for (const FreeSpace::Frontier& f : frontier_) {
        const float area = static_cast<float>(weights_.unknown) * f.area.norm();
        worth.push_back(area);
        worth.push_back(area * static_cast<float>(weights_.coarse));
    }
    return worth;
}

std::optional<std::size_t> ViewScorer::cellOf(std::uint32_t item) const {
    return item / 2 < open_.size() ? std::optional<std::size_t>(item / 2) : std::nullopt;
}

std::optional<std::size_t> ViewScorer::frontierOf(std::uint32_t item) const {
    return item / 2 < open_.size() ? std::nullopt
                                   : std::optional<std::size_t>(item / 2 - open_.size());
}

ViewScorer::Seen ViewScorer::sights(const Pose& world_T_camera) const {
    Seen seen = sightsAtMost(world_T_camera);
    dropHidden(seen.sights, seen.gaps, world_T_camera);
    return seen;
}

void ViewScorer::dropHidden(std::vector<Sight>& sights, std::vector<std::uint32_t>& gaps,
                            const Pose& world_T_camera) const {
    settleSights(sights, gaps, [&](const Sight& gap) {
        return openTo(open_[gap.item / 2]->cell, world_T_camera);
    });
}

ViewScorer::Seen ViewScorer::sightsAtMost(const Pose& world_T_camera) const {
    const Pose camera_T_world = world_T_camera.inverse();
    const std::shared_ptr<const Drawing> drawing = draw(world_T_camera);
    DepthBuffer buffer = drawing->buffer;
    Seen result;
    result.nearShare = nearShareOf(buffer);
    const Eigen::Matrix3f rotation = camera_T_world.rotation.cast<float>();
    const Eigen::Vector3f translation = camera_T_world.translation.cast<float>();
    const auto voxel = static_cast<float>(frontierEdge_);
    SquareDrawer drawer(buffer.squares(camera_T_world, 0.5F * voxel, sensor_.farLimit),
                        buffer.depth);
    drawer.add(frontierCentres_);
    drawer.finish();
    const auto put = [&](std::size_t item, double share) {
        if (share > 0.02) {
            result.sights.push_back({static_cast<std::uint32_t>(item), static_cast<float>(share)});
        }
    };
    const auto margin = static_cast<float>(2.0 * summary_->cellSize());
    for (const BlockView* block : drawing->seen) {
        for (std::size_t i = block->firstOpen; i < block->lastOpen; ++i) {
            const Eigen::Vector3f p = rotation * openCells_[i].wanted + translation;
            const std::optional<float> depth = drawnAt(buffer, p);
            if (!depth) {
                continue;
            }
            const SurfaceCell& cell = open_[i]->cell;
            const bool inSight = *depth >= p.z() - margin;
            if (inSight || (weights_.gapsByLine && cell.hidden > 0)) {
                const Benefit b = benefit(*open_[i], openCells_[i].vain, world_T_camera, false);
                const std::size_t count = result.sights.size();
                put(2 * i, b.torn);
                if (cell.hidden > 0 && result.sights.size() > count) {
                    result.gaps.push_back(static_cast<std::uint32_t>(count));
                }
                put(2 * i + 1, inSight ? b.coarse : 0.0);
            }
        }
    }
    const Eigen::Vector3f eye = world_T_camera.translation.cast<float>();
    for (std::size_t i = 0; i < frontier_.size(); ++i) {
        const Eigen::Vector3f p = rotation * frontier_[i].centre + translation;
        if (!visible(buffer, p, 0.6F * voxel)) {
            continue;
        }
        const Eigen::Vector3f ray = (eye - frontier_[i].centre).normalized();
        const double facing = static_cast<double>(ray.dot(frontier_[i].area.normalized()));
        const double angle = std::clamp(2.0 * facing, 0.0, 1.0);
        const auto z = static_cast<double>(p.z());
        const double afar = newSurfaceShare(z);
        put(2 * (open_.size() + i), angle * afar);
        put(2 * (open_.size() + i) + 1, angle * std::min(1.0, std::pow(goodDepth_ / z, 4)));
    }
    return result;
}

}  // namespace riftmap
