// SPDX-License-Identifier: BSD-3-Clause
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "riftmap/sim/mesh.h"

namespace riftmap {
namespace {

namespace fs = std::filesystem;

/// First line of a text that may have several: messages are one line.
std::string firstLine(const std::string& text) {
    return text.substr(0, text.find('\n'));
}

/// Reads each image once, halves what is too large.
class TextureReader {
 public:
    TextureReader(const aiScene& scene, const std::string& file, int maxSize)
        : scene_(scene), file_(file), maxSize_(maxSize) {}

    cv::Mat read(const aiMaterial& material) {
        aiString path;
        if (material.GetTexture(aiTextureType_DIFFUSE, 0, &path) != aiReturn_SUCCESS &&
            material.GetTexture(aiTextureType_BASE_COLOR, 0, &path) != aiReturn_SUCCESS) {
            return {};
        }
        const auto [entry, isNew] = known_.try_emplace(path.C_Str());
        if (isNew) {
            entry->second = shrink(decode(path.C_Str()));
        }
        return entry->second;
    }

 private:
    cv::Mat decode(const std::string& path) const {
        if (const aiTexture* inside = scene_.GetEmbeddedTexture(path.c_str())) {
            return decodeEmbedded(*inside, path);
        }
        std::string name = path;
        std::replace(name.begin(), name.end(), '\\', '/');
        const fs::path image = fs::path(file_).parent_path() / name;
        cv::Mat texture =
            fs::exists(image) ? cv::imread(image.string(), cv::IMREAD_COLOR) : cv::Mat();
        if (texture.empty()) {
            throw MeshError(file_ + ": texture " + name + " is missing or no image");
        }
        return texture;
    }

    cv::Mat decodeEmbedded(const aiTexture& t, const std::string& path) const {
        if (t.mHeight != 0) {  // raw texels, BGRA in memory
            const cv::Mat raw(static_cast<int>(t.mHeight), static_cast<int>(t.mWidth), CV_8UC4,
                              t.pcData);
            cv::Mat bgr;
            cv::cvtColor(raw, bgr, cv::COLOR_BGRA2BGR);
            return bgr;
        }
        const cv::Mat bytes(1, static_cast<int>(t.mWidth), CV_8UC1, t.pcData);
        cv::Mat texture = cv::imdecode(bytes, cv::IMREAD_COLOR);
        if (texture.empty()) {
            throw MeshError(file_ + ": embedded texture " + path + " cannot be decoded");
        }
        return texture;
    }

    cv::Mat shrink(cv::Mat texture) const {
        while (std::max(texture.cols, texture.rows) > maxSize_) {
            cv::Mat half;
            cv::resize(texture, half, {}, 0.5, 0.5, cv::INTER_AREA);
            texture = half;
        }
        return texture;
    }

    const aiScene& scene_;
    std::string file_;
    int maxSize_;
    std::map<std::string, cv::Mat> known_;
};

std::vector<Material> readMaterials(const aiScene& scene, const std::string& file,
                                    const MeshOptions& options) {
    TextureReader textures(scene, file, options.maxTextureSize);
    std::vector<Material> materials;
    for (unsigned i = 0; i < scene.mNumMaterials; ++i) {
        const aiMaterial& from = *scene.mMaterials[i];
        Material to;
        to.name = from.GetName().C_Str();
        aiColor4D colour;
        if (aiGetMaterialColor(&from, AI_MATKEY_COLOR_DIFFUSE, &colour) == aiReturn_SUCCESS) {
            to.colour = Eigen::Vector3f(colour.r, colour.g, colour.b).cwiseMax(0.0F).cwiseMin(1.0F);
        }
        if (options.textures) {
            to.texture = textures.read(from);
        }
        materials.push_back(std::move(to));
    }
    return materials;
}

void addPart(TriangleMesh& mesh, const aiMesh& part, bool anyUv, bool anyColours) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
        const aiVector3D& p = part.mVertices[i];
        mesh.vertices.emplace_back(p.x, p.y, p.z);
        if (anyUv) {
            const aiVector3D t =
                part.HasTextureCoords(0) ? part.mTextureCoords[0][i] : aiVector3D();
            mesh.uv.emplace_back(t.x, t.y);
        }
        if (anyColours) {
            const aiColor4D c =
                part.HasVertexColors(0) ? part.mColors[0][i] : aiColor4D(1.0F, 1.0F, 1.0F, 1.0F);
            mesh.colours.emplace_back(c.r, c.g, c.b);
        }
    }
    for (unsigned i = 0; i < part.mNumFaces; ++i) {
        const aiFace& face = part.mFaces[i];
        if (face.mNumIndices == 3) {  // points and lines are no surface
            mesh.triangles.push_back(
                {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
            mesh.materialOf.push_back(part.mMaterialIndex);
        }
    }
}

TriangleMesh convert(const aiScene& scene, const std::string& file, const MeshOptions& options) {
    bool anyUv = false;
    bool anyColours = false;
    for (unsigned i = 0; i < scene.mNumMeshes; ++i) {
        anyUv = anyUv || scene.mMeshes[i]->HasTextureCoords(0);
        anyColours = anyColours || scene.mMeshes[i]->HasVertexColors(0);
    }
    TriangleMesh mesh;
    for (unsigned i = 0; i < scene.mNumMeshes; ++i) {
        addPart(mesh, *scene.mMeshes[i], anyUv, anyColours);
    }
    mesh.materials = readMaterials(scene, file, options);
    return mesh;
}

void toMetres(TriangleMesh& mesh, const MeshOptions& options) {
    double scale = options.scale;
    if (options.size > 0) {
        scale = options.size / bounds(mesh).size().maxCoeff();
    }
    for (auto& v : mesh.vertices) {
        if (options.upAxis == MeshOptions::UpAxis::kY) {
            v = Eigen::Vector3f(v.x(), -v.z(), v.y());
        }
        v = (v.cast<double>() * scale).cast<float>();
    }
}

}  // namespace

TriangleMesh loadMesh(const std::string& file, const MeshOptions& options) {
    if (!fs::exists(file)) {
        throw MeshError(file + ": no such file");
    }
    if (!fs::is_regular_file(file)) {
        throw MeshError(file + ": not a file");
    }
    Assimp::Importer importer;
    // Normals would keep vertices of a flat-shaded file apart; ours come from the triangles.
    importer.SetPropertyInteger(
        AI_CONFIG_PP_RVC_FLAGS,
        static_cast<int>(aiComponent_NORMALS) |
            static_cast<int>(aiComponent_TANGENTS_AND_BITANGENTS) |
            static_cast<int>(aiComponent_BONEWEIGHTS) | static_cast<int>(aiComponent_ANIMATIONS) |
            static_cast<int>(aiComponent_LIGHTS) | static_cast<int>(aiComponent_CAMERAS));
    const aiScene* scene = importer.ReadFile(
        file, aiProcess_RemoveComponent | aiProcess_Triangulate | aiProcess_PreTransformVertices |
                  aiProcess_JoinIdenticalVertices);
    if (scene == nullptr) {
        throw MeshError(file + ": " + firstLine(importer.GetErrorString()));
    }
    TriangleMesh mesh = convert(*scene, file, options);
    if (mesh.triangles.empty()) {
        throw MeshError(file + ": no triangles");
    }
    toMetres(mesh, options);
    validate(mesh, file);
    return mesh;
}

}  // namespace riftmap
