// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/graph/pixel_graph.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "pixel_graph_impl.h"

namespace riftmap {
namespace {

void require(bool ok, const std::string& what) {
    if (!ok) {
        throw std::invalid_argument("view: " + what);
    }
}

void check(const View& view) {
    validate(view.camera);
    require(isValid(view.world_T_camera), "pose is not finite or its rotation not orthonormal");
    const DisparityImage& d = view.disparity;
    const std::string size = std::to_string(view.camera.width) + " x " +
                             std::to_string(view.camera.height) + " of the camera";
    require(d.width == view.camera.width && d.height == view.camera.height,
            "disparity image is " + std::to_string(d.width) + " x " + std::to_string(d.height) +
                ", allowed: " + size);
    const auto n = static_cast<std::size_t>(d.width) * static_cast<std::size_t>(d.height);
    require(d.disparity.size() == n && d.sigma.size() == n,
            "disparity and sigma must have a value a pixel");
    if (!view.image.empty()) {
        require(view.image.cols == d.width && view.image.rows == d.height,
                "image is " + std::to_string(view.image.cols) + " x " +
                    std::to_string(view.image.rows) + ", allowed: " + size);
        require(view.image.depth() == CV_8U &&
                    (view.image.channels() == 1 || view.image.channels() == 3),
                "image must have 8 bits and 1 or 3 channels");
    }
}

}  // namespace

PixelGraph::PixelGraph(const GraphOptions& options) : impl_(std::make_unique<Impl>(options)) {}
PixelGraph::~PixelGraph() = default;
PixelGraph::PixelGraph(const PixelGraph& other) : impl_(std::make_unique<Impl>(*other.impl_)) {}
PixelGraph& PixelGraph::operator=(const PixelGraph& other) {
    if (this != &other) {
        impl_ = std::make_unique<Impl>(*other.impl_);
    }
    return *this;
}
PixelGraph::PixelGraph(PixelGraph&&) noexcept = default;
PixelGraph& PixelGraph::operator=(PixelGraph&&) noexcept = default;

const GraphOptions& PixelGraph::options() const {
    return impl_->options;
}
const GraphStorage& PixelGraph::storage() const {
    return impl_->storage;
}
const MergeTimes& PixelGraph::lastMergeTimes() const {
    return impl_->merger.times();
}

MergeResult PixelGraph::merge(const View& view) {
    check(view);
    const MergeResult result = impl_->merger.merge(view, impl_->storage, impl_->rifts, impl_->area);
    impl_->rawPoints += result.rawPoints;
    return result;
}

std::size_t PixelGraph::rawPointCount() const {
    return impl_->rawPoints;
}

std::size_t PixelGraph::memoryBytes() const {
    return sizeof(Impl) + impl_->storage.memoryBytes() + impl_->rifts.memoryBytes();
}

std::size_t PixelGraph::bufferBytes() const {
    return impl_->merger.memoryBytes();
}

void PixelGraph::releaseBuffers() {
    impl_->merger = Merger(impl_->options);
}

double PixelGraph::surfaceArea() const {
    return static_cast<double>(impl_->area) / compact::kAreaUnitsPerSquareMetre;
}

void PixelGraph::clear() {
    impl_ = std::make_unique<Impl>(impl_->options);
}

Vertex PixelGraph::vertex(VertexId id) const {
    const Page& page = storage().page(GraphStorage::pageOf(id));
    const std::uint32_t slot = GraphStorage::slotOf(id);
    return {page.position(slot), compact::decodeDirection(page.normal[slot]), page.rgb[slot],
            compact::Sigma::decode(page.sigma[slot]), page.open[slot]};
}

std::optional<VertexId> PixelGraph::nearest(const Eigen::Vector3f& point, float radius) const {
    const Eigen::Vector3f reach = Eigen::Vector3f::Constant(radius);
    const GraphStorage& s = storage();
    // The page whose box is nearest first: it leaves little to look at in the others.
    std::uint32_t first = GraphStorage::kNoBlock;
    float nearestBox = radius * radius;
    s.forEachBlockIn(point - reach, point + reach, [&](std::uint32_t block) {
        for (const std::uint32_t index : s.blocks()[block].pages) {
            const float outside = s.bounds(index).squaredDistance(point);
            if (outside < nearestBox || first == GraphStorage::kNoBlock) {
                nearestBox = outside;
                first = index;
            }
        }
    });
    if (first == GraphStorage::kNoBlock) {
        return std::nullopt;
    }
    float least = radius * radius;
    VertexId found = kNoVertex;
    const auto look = [&](std::uint32_t index) {
        const Page& page = s.page(index);
        forEachBit(page.alive, [&](std::uint32_t slot) {
            const float dx = page.x[slot] - point.x();
            const float dy = page.y[slot] - point.y();
            const float dz = page.z[slot] - point.z();
            const float squared = dx * dx + dy * dy + dz * dz;
            const VertexId id = GraphStorage::idOf(index, slot);
            if (squared < least || (squared == least && id < found)) {
                least = squared;
                found = id;
            }
        });
    };
    look(first);
    s.forEachBlockIn(point - reach, point + reach, [&](std::uint32_t block) {
        for (const std::uint32_t index : s.blocks()[block].pages) {
            if (index != first && s.bounds(index).squaredDistance(point) <= least) {
                look(index);
            }
        }
    });
    return found == kNoVertex ? std::nullopt : std::optional<VertexId>(found);
}

bool PixelGraph::anyWithin(const Eigen::Vector3f& point, float radius) const {
    const Eigen::Vector3f reach = Eigen::Vector3f::Constant(radius);
    const GraphStorage& s = storage();
    const float limit = radius * radius;
    const auto holds = [&](const Page& page) {
        std::uint64_t near = 0;
        for (std::uint32_t slot = 0; slot < Page::kSize; ++slot) {
            const float dx = page.x[slot] - point.x();
            const float dy = page.y[slot] - point.y();
            const float dz = page.z[slot] - point.z();
            near |= std::uint64_t{dx * dx + dy * dy + dz * dz <= limit} << slot;
        }
        return (near & page.alive) != 0;
    };
    bool found = false;
    s.forEachBlockIn(point - reach, point + reach, [&](std::uint32_t block) {
        const auto& pages = s.blocks()[block].pages;
        found = found || std::any_of(pages.begin(), pages.end(), [&](std::uint32_t index) {
                    return s.bounds(index).squaredDistance(point) <= limit && holds(s.page(index));
                });
    });
    return found;
}

bool PixelGraph::isHigh(VertexId a, VertexId b, float weight) const {
    if (const std::uint16_t* code = storage().findHalfEdge(a, b)) {
        return (*code & compact::kHighBit) != 0;
    }
    if (options().delta > 0) {
        return weight > static_cast<float>(options().delta);
    }
    const float sa = vertex(a).sigma, sb = vertex(b).sigma;
    return weight >
           static_cast<float>(options().targetResolution) + 3.0F * std::sqrt(sa * sa + sb * sb);
}

const std::vector<Rift>& PixelGraph::rifts() const {
    return impl_->rifts.update(impl_->storage);
}

}  // namespace riftmap
