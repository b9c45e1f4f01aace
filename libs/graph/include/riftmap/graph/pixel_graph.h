// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "riftmap/core/options.h"
#include "riftmap/core/view.h"
#include "riftmap/graph/graph_storage.h"

namespace riftmap {

/// Why the surface is torn at a vertex; a set of bits. 0 = closed.
enum OpenKind : std::uint8_t {
    kDepthStep = 1,    ///< a pixel neighbour lies much nearer or farther
    kImageBorder = 2,  ///< the field of view ended there
    kNoMatch = 4,      ///< a pixel neighbour had no disparity
    kTooCoarse = 8,    ///< sampled more sparsely, or known less accurately, than asked for
};

/// Section [Graph]. The paper: fusion = kFirst, typedOpenness = false, a fixed delta,
/// riftExtent = 0.
struct GraphOptions {
    enum class Fusion { kFirst, kInverseVariance };

    double targetResolution = 0.02;  ///< spacing and 2 sigma the surface is asked to have [m]
    /// Weight above which an edge is high [m]; 0 = target resolution plus what noise and viewing
    /// angle explain.
    double delta = 0.0;
    double gamma = 0.01;       ///< association distance [m] (Algorithm 2)
    double visibility = 0.75;  ///< share of an edge that must be seen through (sec. VII)
    Fusion fusion = Fusion::kInverseVariance;  ///< paper: kFirst
    bool typedOpenness = true;  ///< open vertices beyond depth steps; the paper knows only steps
    double blockSize = 0.5;     ///< edge of a spatial block [m]
    double riftExtent = 1.0;    ///< rifts are cut at cubes of this edge [m]; 0 = uncut
    void describe(OptionTable& table);
};

/// A vertex, by value.
struct Vertex {
    Eigen::Vector3f position;  ///< map frame [m]
    Eigen::Vector3f normal;    ///< unit, towards the camera that saw it; zero if unknown
    std::array<std::uint8_t, 3> rgb;
    float sigma;        ///< standard deviation along the viewing ray after fusion [m]
    std::uint8_t open;  ///< OpenKind bits
};

/// A connected tear of the surface (paper sec. V, Algorithm 1): a component of open vertices, or
/// with `typedOpenness` off of high edges, within one cube of `riftExtent`.
struct Rift {
    std::uint32_t id = 0;  ///< follows the tear from view to view where it can
    Eigen::Vector3f centre = Eigen::Vector3f::Zero();  ///< the rift vertex [m]
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< mean of its vertices' normals, unit
    std::vector<VertexId> vertices;  ///< its open vertices (or ends of high edges), ascending
    std::size_t highEdges = 0;       ///< severity S of eq. (12): high edges that touch it
    std::uint8_t kinds = 0;          ///< OpenKind bits of all its vertices
};

/// What one merge did.
struct MergeResult {
    std::size_t rawPoints = 0;  ///< valid pixels of the view
    std::size_t matched = 0;    ///< pixels that met a vertex of the map
    std::size_t newVertices = 0, newEdges = 0;
    std::size_t deletedVertices = 0, deletedEdges = 0;  ///< seen through
};

/// Where the time of the last merge went [ms].
struct MergeTimes {
    double points = 0;     ///< eqs. (1)-(3), patches
    double associate = 0;  ///< cull, project, match
    double fuse = 0;       ///< visibility, fusion, deletion
    double grow = 0;       ///< new vertices and the edges between them
    double edges = 0;      ///< all others
    double normals = 0;
};

/// A saved map of which some parts cannot be read. What could be read is in the graph.
class DamagedMapError : public std::runtime_error {
 public:
    using std::runtime_error::runtime_error;
};

/// The graph of pixels: the map. Reading is thread-safe while nothing writes; rifts() counts as
/// writing when something was merged since its last call.
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
    /// Deterministic for any number of threads. An empty image gives grey vertices.
    MergeResult merge(const View& view);
    const MergeTimes& lastMergeTimes() const;

    std::size_t vertexCount() const { return storage().vertexCount(); }
    std::size_t edgeCount() const { return storage().edgeCount(); }  ///< undirected
    std::size_t rawPointCount() const;  ///< valid pixels of all views so far
    /// Everything allocated for the map: vertices, edges, hash, rifts.
    std::size_t memoryBytes() const;
    /// Buffers that merge() keeps from view to view. They grow with what one view sees, not with
    /// the map. Not counted: a few rows of edges that each thread keeps for itself.
    std::size_t bufferBytes() const;
    /// Frees them; the next merge makes them anew. Copies of a graph come without.
    void releaseBuffers();
    double surfaceArea() const;  ///< [m^2]; each patch once, however many views saw it
    void clear();

    /// Ids are below this; some may be dead.
    VertexId idLimit() const { return storage().pageCount() * Page::kSize; }
    bool alive(VertexId id) const { return storage().alive(id); }
    Vertex vertex(VertexId id) const;  ///< id must be alive
    Eigen::Vector3f position(VertexId id) const { return storage().position(id); }
    std::uint8_t open(VertexId id) const {  ///< OpenKind bits; id must be alive
        return storage().page(GraphStorage::pageOf(id)).open[GraphStorage::slotOf(id)];
    }

    /// Calls f(neighbour, weight [m]) for each edge of a vertex, in a fixed order; also
    /// f(neighbour, weight, high) where f takes three arguments.
    template <class F>
    void forEachEdge(VertexId id, F&& f) const {
        storage().forEachHalfEdge(id, [&f](VertexId n, std::uint16_t code) {
            if constexpr (std::is_invocable_v<F&, VertexId, float, bool>) {
                f(n, compact::weightOf(code), (code & compact::kHighBit) != 0);
            } else {
                f(n, compact::weightOf(code));
            }
        });
    }
    /// Calls f(id) for every living vertex, ascending in id.
    template <class F>
    void forEachVertex(F&& f) const {
        storage().forEachVertex(f);
    }
    /// Calls f(id) for every living vertex in the box, bounds included; in a fixed order.
    template <class F>
    void forEachVertexIn(const Eigen::Vector3f& min, const Eigen::Vector3f& max, F&& f) const {
        forEachPageIn(min, max, [&](std::uint32_t index, const Page& page) {
            forEachBit(page.alive, [&](std::uint32_t s) {
                if (page.x[s] >= min.x() && page.x[s] <= max.x() && page.y[s] >= min.y() &&
                    page.y[s] <= max.y() && page.z[s] >= min.z() && page.z[s] <= max.z()) {
                    f(GraphStorage::idOf(index, s));
                }
            });
        });
    }
    /// Calls f(id) for every open vertex in the box; skips closed surface 64 vertices at a time.
    template <class F>
    void forEachOpenVertexIn(const Eigen::Vector3f& min, const Eigen::Vector3f& max, F&& f) const {
        forEachVertexIn(min, max, [&](VertexId id) {
            if (open(id) != 0) {
                f(id);
            }
        });
    }
    /// Calls f(page index, page) for every page whose bounds meet the box: the arrays of up to 64
    /// vertices that lie near each other, for loops that want them as spans.
    template <class F>
    void forEachPageIn(const Eigen::Vector3f& min, const Eigen::Vector3f& max, F&& f) const {
        const GraphStorage& s = storage();
        s.forEachBlockIn(min, max, [&](std::uint32_t block) {
            for (const std::uint32_t index : s.blocks()[block].pages) {
                if (s.bounds(index).meets(min, max)) {
                    f(index, s.page(index));
                }
            }
        });
    }
    /// Nearest living vertex within the radius [m]; the smallest id among equally near ones.
    std::optional<VertexId> nearest(const Eigen::Vector3f& point, float radius) const;
    /// True if nearest() would find a vertex: faster, for the first one found will do.
    bool anyWithin(const Eigen::Vector3f& point, float radius) const;
    /// True where the weight makes an edge between these vertices high: what the views said about
    /// the edge if it exists, else by delta or target resolution plus noise.
    bool isHigh(VertexId a, VertexId b, float weight) const;

    /// The rifts as of the last merge, ordered by id; brought up to date from what changed.
    const std::vector<Rift>& rifts() const;

    /// Versioned, little-endian, a checksum a block. Loading throws std::runtime_error for what is
    /// no map of ours (the graph is unchanged then), and DamagedMapError that names the damaged
    /// blocks after loading all others. Ids and rift ids stay the same.
    void save(std::ostream& out) const;
    void load(std::istream& in);

    /// The arrays themselves; for reading.
    const GraphStorage& storage() const;

 private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

/// Vertices of each map that have no partner in the other within a distance.
struct GraphComparison {
    std::size_t verticesA = 0, verticesB = 0;
    std::size_t onlyInA = 0, onlyInB = 0;
    double meanDistance = 0;  ///< of those with a partner, both ways [m]
};

/// Compares two maps of one frame; `distance` > 0 [m]. Parallel, deterministic.
GraphComparison compareGraphs(const PixelGraph& a, const PixelGraph& b, double distance);

}  // namespace riftmap
