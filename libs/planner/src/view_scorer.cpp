// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/view_scorer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "riftmap/core/parallel.h"
#include "riftmap/core/whole.h"
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
    float fx = 0, fy = 0, cx = 0, cy = 0;            ///< [px of the buffer]
    float left = 0, top = 0, right = 0, bottom = 0;  ///< of what is seen [px of the buffer]
    float nearest = 0, farthest = 0;                 ///< what is seen [m]
    std::vector<float> depth;

    float& at(int column, int row) {
        return depth[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                     static_cast<std::size_t>(column)];
    }
    float at(int column, int row) const {
        return depth[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                     static_cast<std::size_t>(column)];
    }
    SquareCamera squares(const Pose& camera_T_world, float half) const;
    /// Depth that is drawn where this place is in the image [m]; nothing if it is out of range or
    /// of the true field of view.
    std::optional<float> drawnAt(const Eigen::Vector3f& inCamera) const {
        if (!(inCamera.z() >= nearest && inCamera.z() <= farthest)) {
            return std::nullopt;
        }
        const float u = fx * inCamera.x() / inCamera.z() + cx;
        const float v = fy * inCamera.y() / inCamera.z() + cy;
        if (!(u >= left && u <= right && v >= top && v <= bottom)) {
            return std::nullopt;
        }
        // What is left over of an image of no whole number of them belongs to the last.
        return at(std::min(wholeBelow(u + 0.5F), width - 1),
                  std::min(wholeBelow(v + 0.5F), height - 1));
    }
    /// In the image, and nothing drawn more than `slack` before it.
    bool visible(const Eigen::Vector3f& inCamera, float slack) const {
        const std::optional<float> drawn = drawnAt(inCamera);
        return drawn && *drawn >= inCamera.z() - slack;
    }
};

/// What squares are drawn with into this buffer; half their edge in metres.
SquareCamera ViewScorer::DepthBuffer::squares(const Pose& camera_T_world, float half) const {
    SquareCamera c;
    c.rotation = camera_T_world.rotation.cast<float>();
    c.translation = camera_T_world.translation.cast<float>();
    c.fx = fx;
    c.fy = fy;
    c.cx = cx;
    c.cy = cy;
    c.half = half;
    c.nearest = kNearest;
    c.farthest = farthest;
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
    parallelForEach(open_.size(), 256,
                    [&](std::size_t i) { openCells_[i] = openCellOf(*open_[i]); });
}

void ViewScorer::groupBlocks() {
    constexpr float kBlocks = 4;  // of a group, along each axis
    std::map<std::array<int, 3>, std::size_t> index;
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
        const Eigen::AlignedBox3f box = blocks_[i].block->box.cast<float>();
        const Eigen::Vector3i at = wholesBelow(blocks_[i].centre / (kBlocks * box.sizes().x()));
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
bool ViewScorer::openTo(const OpenCell& cell, const Pose& world_T_camera) const {
    constexpr float kClose = 4;  // [cells]
    const float reach = weights_.gapsByLine ? kFar : kClose;
    const auto open = [&](const Eigen::Vector3d& eye) {
        return summary_->openTowards(cell.wanted, eye.cast<float>(), reach);
    };
    return open(world_T_camera.translation) &&
           (sensor_.exactDepth() ||
            open(world_T_camera * Eigen::Vector3d(sensor_.camera.baseline, 0, 0)));
}

ViewScorer::OpenCell ViewScorer::openCellOf(const RiftRecord& record) const {
    const SurfaceCell& cell = record.cell;
    const auto direction = [](const Eigen::Vector3d& facing) -> Eigen::Vector3d {
        constexpr double kClear = 0.3;  // a shorter mean is of normals that cancel: any side may do
        return facing.norm() > kClear ? facing.normalized() : Eigen::Vector3d::Zero();
    };
    OpenCell c;
    c.record = &record;
    c.open = cell.openPosition;
    c.wanted = cell.hidden > 0 ? cell.hiddenPosition : cell.openPosition;
    c.hides = cell.hidden > 0;
    c.tried = !record.attempts.empty();
    c.vain = leftAfterTries(record);
    c.torn = weights_.hidden * static_cast<double>(cell.hidden) + besideRim(cell);
    c.coarse = weights_.coarse * static_cast<double>(cell.coarse);
    // What a gap hides faces as the gap does. At other silhouettes the surface bends away over the
    // rim: what is to be seen faces outwards too, the more so if views from where the rim's own
    // surface is seen well were in vain.
    Eigen::Vector3d facing = cell.openNormal.cast<double>();
    if ((cell.kinds & kDepthStep) != 0) {
        const double over = 0.7 * (1.0 + static_cast<double>(record.attempts.size()));
        facing += over * cell.outward.cast<double>();
    }
    c.facing = direction(facing);
    c.hiddenFacing = direction(cell.hiddenNormal.cast<double>());
    return c;
}

ViewScorer::Benefit ViewScorer::benefit(const RiftRecord& record,
                                        const Pose& world_T_camera) const {
    return benefit(openCellOf(record), world_T_camera, true);
}

ViewScorer::Benefit ViewScorer::benefit(const OpenCell& cell, const Pose& world_T_camera,
                                        bool withLines) const {
    const Eigen::Vector3d& eye = world_T_camera.translation;
    if (cell.tried && RiftLedger::tried(*cell.record, eye)) {
        return {};
    }
    const Eigen::Vector3d ray = eye - cell.open.cast<double>();
    const double distance = ray.norm();
    const auto angleTo = [&](const Eigen::Vector3d& facing) {
        return facing.isZero(0) ? 0.6 : ray.dot(facing) / distance;
    };
    const auto qualityOn = [&](const Eigen::Vector3d& facing) {
        const double angle = angleTo(facing);
        // Matching is worse at flat angles.
        return sensor_.matched() ? std::clamp((angle - 0.2) / 0.35, 0.0, 1.0)
                                 : std::clamp((angle - 0.15) / 0.1, 0.0, 1.0);
    };
    const double coarseQuality = qualityOn(cell.facing);
    double tornQuality = coarseQuality;
    if (cell.hides) {
        // Along open lines about so much of what the dragon's gaps hid was seen.
        const bool hint = weights_.gapsByLine && !sensor_.matched();
        tornQuality = hint ? 0.5 * (1 + angleTo(cell.hiddenFacing)) : qualityOn(cell.hiddenFacing);
        if (withLines && tornQuality > 0 && !openTo(cell, world_T_camera)) {
            tornQuality = 0;
        }
    }
    // New surface is worth something from afar too; known surface gets better only from where the
    // view measures well.
    const double torn = newSurfaceShare(distance);
    const double coarse = std::clamp((1.6 * goodDepth_ - distance) / (0.6 * goodDepth_), 0.0, 1.0);
    Benefit result;
    result.torn = tornQuality * cell.vain * torn;
    result.coarse = coarseQuality * cell.vain * coarse;
    result.coarseArea = result.coarse * cell.coarse;
    result.area = result.torn * cell.torn + result.coarseArea;
    result.quality = result.torn * cell.torn > 0.3 * result.coarseArea ? tornQuality * torn
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
    const auto inBuffer = [](double pixel) {
        return static_cast<float>((pixel + 0.5) / kPixels - 0.5);
    };
    b.cx = inBuffer(c.cx);
    b.cy = inBuffer(c.cy);
    b.left = inBuffer(sensor_.firstColumn + kMargin);
    b.top = inBuffer(kMargin);
    b.right = inBuffer(c.width - 1 - kMargin);
    b.bottom = inBuffer(c.height - 1 - kMargin);
    b.nearest = std::max(static_cast<float>(1.02 * sensor_.nearLimit), kNearest);
    b.farthest = static_cast<float>(sensor_.farLimit);
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
    SquareDrawer drawer(b.squares(camera_T_world, half), b.depth);
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
    const Eigen::Matrix3f rotation = camera_T_world.rotation.cast<float>();
    const Eigen::Vector3f translation = camera_T_world.translation.cast<float>();
    const DepthBuffer& buffer = drawing.buffer;
    result.nearShare = nearShareOf(buffer);
    const auto slack = static_cast<float>(2.0 * summary_->cellSize());
    double seenWell = 0;  // [m^2] of openGain
    for (const BlockView* block : drawing.seen) {
        const std::size_t first = (block->firstOpen + stride - 1) / stride * stride;
        for (std::size_t i = first; i < block->lastOpen; i += stride) {
            if (!buffer.visible(rotation * openCells_[i].open + translation, slack)) {
                continue;
            }
            const Benefit b = benefit(openCells_[i], world_T_camera, true);
            if (b.area <= 0) {
                continue;
            }
            result.openGain += static_cast<double>(stride) * b.area;
            result.coarseGain += static_cast<double>(stride) * b.coarseArea;
            const bool well = b.quality > 0.5;
            (well ? result.cells : result.badlySeen).push_back(openCells_[i].record->cell.key);
            seenWell += well ? static_cast<double>(stride) * b.area : 0.0;
        }
    }
    std::sort(result.cells.begin(), result.cells.end());
    if (seenWell >= 0.5 * result.openGain) {
        result.badlySeen.clear();
    }
    const double side = static_cast<double>(kPixels * rayStride) / sensor_.camera.fx;
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
    for (const OpenCell& cell : openCells_) {
        worth.push_back(static_cast<float>(cell.torn));
        worth.push_back(static_cast<float>(weights_.doubt) * cell.record->cell.doubt);
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
        return openTo(openCells_[gap.item / 2], world_T_camera);
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
    SquareDrawer drawer(buffer.squares(camera_T_world, 0.5F * voxel), buffer.depth);
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
            const std::optional<float> depth = buffer.drawnAt(p);
            if (!depth) {
                continue;
            }
            const OpenCell& cell = openCells_[i];
            const bool inSight = *depth >= p.z() - margin;
            if (inSight || (weights_.gapsByLine && cell.hides)) {
                const Benefit b = benefit(cell, world_T_camera, false);
                const std::size_t count = result.sights.size();
                put(2 * i, b.torn);
                if (cell.hides && result.sights.size() > count) {
                    result.gaps.push_back(static_cast<std::uint32_t>(count));
                }
                put(2 * i + 1, inSight ? b.coarse : 0.0);
            }
        }
    }
    const Eigen::Vector3f eye = world_T_camera.translation.cast<float>();
    for (std::size_t i = 0; i < frontier_.size(); ++i) {
        const Eigen::Vector3f p = rotation * frontier_[i].centre + translation;
        if (!buffer.visible(p, 0.6F * voxel)) {
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
