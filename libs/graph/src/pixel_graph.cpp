// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/graph/pixel_graph.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "distance_kernel.h"
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
    float least = radius * radius;
    VertexId found = kNoVertex;
    s.forEachBlockIn(point - reach, point + reach, [&](std::uint32_t block) {
        for (const std::uint32_t index : s.blocks()[block].pages) {
            if (s.bounds(index).squaredDistance(point) > least) {
                continue;
            }
            const Page& page = s.page(index);
            forEachBit(verticesWithin(page, point, least), [&](std::uint32_t slot) {
                const float squared = squaredDistance(page, slot, point);
                const VertexId id = GraphStorage::idOf(index, slot);
                if (squared < least || (squared == least && id < found)) {
                    least = squared;
                    found = id;
                }
            });
        }
    });
    return found == kNoVertex ? std::nullopt : std::optional<VertexId>(found);
}

bool PixelGraph::anyWithin(const Eigen::Vector3f& point, float radius) const {
    const Eigen::Vector3f reach = Eigen::Vector3f::Constant(radius);
    const GraphStorage& s = storage();
    const float limit = radius * radius;
    bool found = false;
    s.forEachBlockIn(point - reach, point + reach, [&](std::uint32_t block) {
        const auto& pages = s.blocks()[block].pages;
        found = found || std::any_of(pages.begin(), pages.end(), [&](std::uint32_t index) {
                    return s.bounds(index).squaredDistance(point) <= limit &&
                           verticesWithin(s.page(index), point, limit) != 0;
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
