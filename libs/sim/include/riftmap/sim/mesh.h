// SPDX-License-Identifier: BSD-3-Clause
// The surface of a world: triangles with colours, textures and noise. World frame, metres, z up.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "riftmap/core/options.h"

namespace riftmap {

/// How a surface looks. Without a texture the colour is modulated by a solid noise that is fixed
/// in the world, so that every camera sees the same speckle at the same place.
struct Material {
    /// A regular pattern over the noise, fixed in the world.
    enum class Pattern { kNone, kBricks, kPlanks, kTiles };

    std::string name;
    Eigen::Vector3f colour{0.7F, 0.7F, 0.7F};  ///< red, green, blue in 0 .. 1
    cv::Mat texture;                           ///< 8-bit BGR, or empty; first row at v = 1; repeats
    float noise = 1.0F;              ///< contrast of the noise relative to the world's, >= 0
    float noiseSize = 0.5F;          ///< [m] size of its coarsest blotches, > 0
    Eigen::Vector3f grain{1, 1, 1};  ///< stretches the noise along the axes (wood), > 0
    Pattern pattern = Pattern::kNone;
    float patternSize = 0.3F;  ///< [m] length of a brick, plank width, side of a tile
};

/// Plain triangles. A triangle's front side is the one from which its corners run anti-clockwise;
/// both sides can be seen. Vertices at seams of the texture may be stored twice.
struct TriangleMesh {
    std::vector<Eigen::Vector3f> vertices;                ///< [m]
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into `vertices`
    std::vector<Eigen::Vector2f> uv;        ///< texture coordinates a vertex, or empty
    std::vector<Eigen::Vector3f> colours;   ///< red, green, blue in 0 .. 1 a vertex, or empty
    std::vector<Material> materials;        ///< or empty: the default material
    std::vector<std::uint32_t> materialOf;  ///< a triangle, or empty: the first material

    std::array<Eigen::Vector3d, 3> corners(std::size_t triangle) const;
    /// Unit normal of the front side; zero for a triangle without area.
    Eigen::Vector3d normal(std::size_t triangle) const;
    double area(std::size_t triangle) const;  ///< [m^2]
};

/// Smallest axis-aligned box around the vertices that triangles use.
struct Bounds {
    Eigen::Vector3d min = Eigen::Vector3d::Constant(1e30);   ///< [m]
    Eigen::Vector3d max = Eigen::Vector3d::Constant(-1e30);  ///< [m]
    Eigen::Vector3d size() const { return max - min; }
    Eigen::Vector3d centre() const { return (min + max) / 2; }
    bool contains(const Eigen::Vector3d& p) const {
        return (p.array() >= min.array()).all() && (p.array() <= max.array()).all();
    }
};
Bounds bounds(const TriangleMesh& mesh);

/// Sum over all triangles [m^2]; a sheet counts once.
double area(const TriangleMesh& mesh);

/// 64-bit FNV-1a of vertices and triangles: the same surface gives the same number anywhere.
std::uint64_t hashOf(const TriangleMesh& mesh);

/// Adds b to a; materials are kept apart.
void append(TriangleMesh& a, const TriangleMesh& b);

/// Appends nothing that cannot be used: throws MeshError for no triangles, an index out of range,
/// a vertex that is not finite, or a size outside 1 mm .. 2 km. `name` begins the message.
void validate(const TriangleMesh& mesh, const std::string& name);

/// A world that cannot be used; one line that names the file and what is wrong with it.
class MeshError : public std::runtime_error {
 public:
    using std::runtime_error::runtime_error;
};

/// How a mesh file becomes metres, z up.
struct MeshOptions {
    enum class UpAxis { kZ, kY };

    double scale = 1.0;  ///< metres per unit of the file
    /// If > 0: scaled about the mesh's own origin so that the largest side of its bounding box
    /// is this long [m]; `scale` has no effect then.
    double size = 0.0;
    UpAxis upAxis = UpAxis::kZ;  ///< of the file; y is turned to z about the x axis
    bool textures = true;        ///< read image files too
    int maxTextureSize = 2048;   ///< [px] larger textures are halved until they fit
};

/// Reads OBJ (with textures), PLY, OFF, STL, glTF and whatever else assimp knows. Neither shifted
/// nor turned unless the options ask. Throws MeshError, also for what `validate` finds.
TriangleMesh loadMesh(const std::string& file, const MeshOptions& options = {});

}  // namespace riftmap
