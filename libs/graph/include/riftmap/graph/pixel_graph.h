// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <optional>
#include <vector>

#include "riftmap/core/options.h"
#include "riftmap/core/view.h"

namespace riftmap {

/// Names a vertex of a PixelGraph; stays valid until that vertex is deleted.
using VertexId = std::uint32_t;
inline constexpr VertexId kNoVertex = 0xFFFFFFFFU;

/// Why the surface is torn at a vertex; a set of bits. 0 = closed.
enum OpenKind : std::uint8_t {
    kDepthStep = 1,    ///< a pixel neighbour lies much nearer or farther
    kImageBorder = 2,  ///< the field of view ended there
    kNoMatch = 4,      ///< a pixel neighbour had no disparity
    kTooCoarse = 8,    ///< sampled more sparsely, or known less accurately, than asked for
};

/// Section [Graph].
struct GraphOptions {
    enum class Fusion { kFirst, kInverseVariance };

    double targetResolution = 0.02;  ///< spacing and 2 sigma the surface is asked to have [m]
    double delta = 0.0;   ///< weight above which an edge is high [m]; 0 = adaptive (design.md 4)
    double gamma = 0.01;  ///< association distance [m] (Algorithm 2)
    double visibility = 0.75;  ///< share of an edge that must be seen through (sec. VII)
    Fusion fusion = Fusion::kInverseVariance;  ///< paper: kFirst
    bool typedOpenness = true;  ///< open vertices beyond depth steps; the paper knows only steps
    double blockSize = 0.5;     ///< edge of a spatial block [m]
    void describe(OptionTable& table);
};

/// A vertex, by value.
struct Vertex {
    Eigen::Vector3f position;  ///< map frame [m]
    Eigen::Vector3f normal;    ///< unit, towards the camera that saw it; zero if unknown
    std::array<std::uint8_t, 3> rgb;
    float sigma;        ///< standard deviation along the normal after fusion [m]
    std::uint8_t open;  ///< OpenKind bits
};

/// A connected tear of the surface (paper sec. V, Algorithm 1).
struct Rift {
    std::uint32_t id = 0;  ///< follows the tear from view to view where it can
    Eigen::Vector3f centre = Eigen::Vector3f::Zero();  ///< the rift vertex [m]
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< mean of its vertices' normals, unit
    std::vector<VertexId> vertices;  ///< its open vertices and ends of high edges, ascending
    std::size_t highEdges = 0;       ///< severity S of eq. (12)
    std::uint8_t kinds = 0;          ///< OpenKind bits of all its vertices
};

/// What one merge did.
struct MergeResult {
    std::size_t rawPoints = 0;  ///< valid pixels of the view
    std::size_t matched = 0;    ///< pixels that met a vertex of the map
    std::size_t newVertices = 0, newEdges = 0;
    std::size_t deletedVertices = 0, deletedEdges = 0;  ///< seen through
};

/// The graph of pixels: the map. Reading is thread-safe while nothing writes.
class PixelGraph {
 public:
    explicit PixelGraph(const GraphOptions& options = {});
    ~PixelGraph();
    PixelGraph(const PixelGraph& other);
    PixelGraph& operator=(const PixelGraph& other);
    PixelGraph(PixelGraph&&) noexcept;
    PixelGraph& operator=(PixelGraph&&) noexcept;

    const GraphOptions& options() const;

    /// Algorithm 2 against everything in view, then sec. VII. Throws std::invalid_argument for a
    /// view with an invalid camera or pose or images of different sizes; the map is unchanged then.
    MergeResult merge(const View& view);

    std::size_t vertexCount() const;
    std::size_t edgeCount() const;      ///< undirected
    std::size_t rawPointCount() const;  ///< valid pixels of all views so far
    std::size_t memoryBytes() const;    ///< everything allocated, edges and hash included
    double surfaceArea() const;         ///< [m^2]
    void clear();

    /// Ids are below this; some may be dead.
    VertexId idLimit() const;
    bool alive(VertexId id) const;
    Vertex vertex(VertexId id) const;  ///< id must be alive
    Eigen::Vector3f position(VertexId id) const;
    /// Calls f(neighbour, weight [m]) for each edge of a vertex, in a fixed order.
    void forEachEdge(VertexId id, const std::function<void(VertexId, float)>& f) const;
    /// Calls f(id) for every living vertex, ascending in id.
    void forEachVertex(const std::function<void(VertexId)>& f) const;
    /// Calls f(id) for every living vertex in the box.
    void forEachVertexIn(const Eigen::Vector3f& min, const Eigen::Vector3f& max,
                         const std::function<void(VertexId)>& f) const;
    /// Nearest living vertex within the radius [m].
    std::optional<VertexId> nearest(const Eigen::Vector3f& point, float radius) const;
    /// True where the weight makes an edge between these vertices high.
    bool isHigh(VertexId a, VertexId b, float weight) const;

    /// The rifts as of the last merge, ordered by id; brought up to date from what changed.
    const std::vector<Rift>& rifts() const;

    /// Versioned, little-endian, a checksum a block. Loading throws std::runtime_error that names
    /// the damaged part.
    void save(std::ostream& out) const;
    void load(std::istream& in);

 private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace riftmap
