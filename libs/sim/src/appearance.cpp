// SPDX-License-Identifier: BSD-3-Clause
#include "appearance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <opencv2/imgproc.hpp>
#include <unordered_map>

#include "random_bits.h"

namespace riftmap {
namespace {

// ---- Patterns ----------------------------------------------------------------------------------

/// Coverage of a joint of this width [m] at distance `d` from its middle, for a pixel this large.
float joint(float d, float width, float footprint) {
    const float seen = std::max(width, footprint);
    return std::clamp((seen / 2 + footprint / 2 - d) / footprint, 0.0F, 1.0F) * (width / seen);
}

float distanceToJoint(float x, float pitch) {
    const float r = x / pitch - std::floor(x / pitch);
    return std::min(r, 1 - r) * pitch;
}

/// Brightness of a regular pattern in the surface's own plane (s along, t up).
float pattern(const Material& m, float s, float t, float footprint) {
    const float size = m.patternSize;
    float dark = 0;
    float pitchS = size;
    float pitchT = size;
    float width = 0.012F;
    switch (m.pattern) {
        case Material::Pattern::kNone:
            return 1;
        case Material::Pattern::kBricks:
            pitchT = size / 2;
            if (static_cast<long>(std::floor(t / pitchT)) & 1L) {
                s += pitchS / 2;
            }
            break;
        case Material::Pattern::kPlanks:
            pitchS = size * 9;
            s += size * 3.7F * std::floor(t / pitchT);
            width = 0.005F;
            break;
        case Material::Pattern::kTiles:
            break;
    }
    dark = std::max(joint(distanceToJoint(s, pitchS), width, footprint),
                    joint(distanceToJoint(t, pitchT), width, footprint));
    const auto column = static_cast<std::int64_t>(std::floor(s / pitchS));
    const auto row = static_cast<std::int64_t>(std::floor(t / pitchT));
    const auto key = static_cast<std::uint64_t>(column * 7919 + row);
    const float tint = static_cast<float>(mixBits(7, key) & 0xFFU) / 255.0F - 0.5F;
    return (1 - 0.4F * dark) * (1 + 0.22F * tint);
}

float patternAt(const Material& m, const Eigen::Vector3f& p, const Eigen::Vector3d& normal,
                float footprint) {
    if (m.pattern == Material::Pattern::kNone) {
        return 1;
    }
    const Eigen::Vector3d n = normal.cwiseAbs();
    if (n.z() > n.x() && n.z() > n.y()) {
        return pattern(m, p.x(), p.y(), footprint);
    }
    return pattern(m, n.x() > n.y() ? p.y() : p.x(), p.z(), footprint);
}

}  // namespace

// ---- Mip maps ----------------------------------------------------------------------------------

MipMap::MipMap(const cv::Mat& bgr) {
    levels_.push_back(bgr);
    while (std::min(levels_.back().cols, levels_.back().rows) > 1) {
        cv::Mat half;
        const cv::Size size((levels_.back().cols + 1) / 2, (levels_.back().rows + 1) / 2);
        cv::resize(levels_.back(), half, size, 0, 0, cv::INTER_AREA);
        levels_.push_back(half);
    }
}

Eigen::Vector3f MipMap::bilinear(std::size_t level, float u, float v) const {
    const cv::Mat& image = levels_[level];
    const float x = (u - std::floor(u)) * static_cast<float>(image.cols) - 0.5F;
    const float y = (1 - (v - std::floor(v))) * static_cast<float>(image.rows) - 0.5F;
    const float fx = std::floor(x);
    const float fy = std::floor(y);
    const auto wrap = [](int i, int n) { return ((i % n) + n) % n; };
    const int x0 = wrap(static_cast<int>(fx), image.cols);
    const int x1 = wrap(static_cast<int>(fx) + 1, image.cols);
    const int y0 = wrap(static_cast<int>(fy), image.rows);
    const int y1 = wrap(static_cast<int>(fy) + 1, image.rows);
    const auto texel = [&](int c, int r) {
        const auto& p = image.ptr<cv::Vec3b>(r)[c];
        return Eigen::Vector3f(p[2], p[1], p[0]);
    };
    const float a = x - fx;
    const float b = y - fy;
    const Eigen::Vector3f top = (1 - a) * texel(x0, y0) + a * texel(x1, y0);
    const Eigen::Vector3f bottom = (1 - a) * texel(x0, y1) + a * texel(x1, y1);
    return ((1 - b) * top + b * bottom) * (1 / 255.0F);
}

Eigen::Vector3f MipMap::sample(float u, float v, float footprint) const {
    // Between powers of two linearly in the footprint: needs no logarithm, hence the same bits
    // everywhere.
    std::size_t level = 0;
    float texels = 1;
    while (level + 1 < levels_.size() && footprint >= 2 * texels) {
        texels *= 2;
        ++level;
    }
    const float between = std::clamp(footprint / texels - 1, 0.0F, 1.0F);
    Eigen::Vector3f fine = bilinear(level, u, v);
    if (between == 0 || level + 1 == levels_.size()) {
        return fine;
    }
    return (1 - between) * fine + between * bilinear(level + 1, u, v);
}

// ---- Appearance --------------------------------------------------------------------------------

Appearance::Appearance(const TriangleMesh& mesh) : mesh_(mesh), materials_(mesh.materials) {
    if (materials_.empty()) {
        materials_.emplace_back();
    }
    std::map<const void*, MipMap> known;  // images are shared between materials
    for (const Material& material : materials_) {
        if (material.texture.empty() || mesh.uv.empty()) {
            textures_.emplace_back();
            continue;
        }
        auto& mipMap = known[material.texture.data];
        if (mipMap.empty()) {
            mipMap = MipMap(material.texture);
        }
        textures_.push_back(mipMap);
    }
    if (!known.empty()) {
        texelsPerMetre_.resize(mesh.triangles.size());
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            const MipMap& texture = textures_[materialOf(static_cast<std::uint32_t>(i))];
            if (texture.empty()) {
                continue;
            }
            const auto& t = mesh.triangles[i];
            const Eigen::Vector2f a = mesh.uv[t[1]] - mesh.uv[t[0]];
            const Eigen::Vector2f b = mesh.uv[t[2]] - mesh.uv[t[0]];
            const float texels = std::abs(a.x() * b.y() - a.y() * b.x()) / 2 *
                                 static_cast<float>(texture.width()) *
                                 static_cast<float>(texture.height());
            const auto metres = static_cast<float>(mesh.area(i));
            texelsPerMetre_[i] = metres > 0 ? std::sqrt(texels / metres) : 0.0F;
        }
    }
    smoothNormals();
}

void Appearance::smoothNormals() {
    // Triangles that meet at a place (vertices may be stored several times) share a normal there
    // if they are inclined to each other by less than 40 degrees.
    constexpr double kCrease = 0.766;
    struct PlaceHash {
        std::size_t operator()(const std::array<float, 3>& p) const {
            std::uint64_t h = 0;
            for (const float x : p) {
                std::uint32_t bits = 0;
                std::memcpy(&bits, &x, sizeof(bits));
                h = mixBits(h, bits);
            }
            return h;
        }
    };
    std::unordered_map<std::array<float, 3>, std::vector<std::uint32_t>, PlaceHash> around;
    around.reserve(mesh_.vertices.size());
    const auto placeOf = [&](std::uint32_t v) {
        const Eigen::Vector3f p = mesh_.vertices[v] + Eigen::Vector3f::Zero();  // -0 becomes 0
        return std::array<float, 3>{p.x(), p.y(), p.z()};
    };
    std::vector<Eigen::Vector3d> flat(mesh_.triangles.size());
    std::vector<double> weight(mesh_.triangles.size());
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
        flat[i] = mesh_.normal(i);
        weight[i] = mesh_.area(i);
        for (const auto v : mesh_.triangles[i]) {
            around[placeOf(v)].push_back(i);
        }
    }
    normals_.resize(mesh_.triangles.size());
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            Eigen::Vector3d sum = Eigen::Vector3d::Zero();
            for (const auto j : around[placeOf(mesh_.triangles[i][k])]) {
                if (flat[j].dot(flat[i]) > kCrease) {
                    sum += weight[j] * flat[j];
                }
            }
            const double length = sum.norm();
            normals_[i][k] =
                (length > 0 ? Eigen::Vector3d(sum / length) : flat[i]).template cast<float>();
        }
    }
}

Eigen::Vector3f Appearance::shadingNormal(const Hit& hit) const {
    const auto& n = normals_[hit.triangle];
    const Eigen::Vector3f sum = (1 - hit.u - hit.v) * n[0] + hit.u * n[1] + hit.v * n[2];
    const float length = sum.norm();
    return length > 0 ? Eigen::Vector3f(sum / length) : n[0];
}

Eigen::Vector3f Appearance::colour(const Hit& hit, const Eigen::Vector3f& point,
                                   float footprint) const {
    const std::uint32_t index = materialOf(hit.triangle);
    const Material& material = materials_[index];
    const auto& corner = mesh_.triangles[hit.triangle];
    const float w = 1 - hit.u - hit.v;
    if (!textures_[index].empty()) {
        const Eigen::Vector2f uv =
            w * mesh_.uv[corner[0]] + hit.u * mesh_.uv[corner[1]] + hit.v * mesh_.uv[corner[2]];
        return textures_[index].sample(uv.x(), uv.y(), footprint * texelsPerMetre_[hit.triangle]);
    }
    Eigen::Vector3f colour = material.colour;
    if (!mesh_.colours.empty()) {
        const auto& c = mesh_.colours;
        colour =
            colour.cwiseProduct(w * c[corner[0]] + hit.u * c[corner[1]] + hit.v * c[corner[2]]);
    }
    return colour * patternAt(material, point, hit.normal, footprint);
}

const Material* Appearance::noiseOf(std::uint32_t triangle) const {
    const std::uint32_t index = materialOf(triangle);
    return textures_[index].empty() && materials_[index].noise > 0 ? &materials_[index] : nullptr;
}

}  // namespace riftmap
