// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

namespace riftmap {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A folder of its own for every test.
class MeshFile : public testing::Test {
 protected:
    void SetUp() override {
        const auto* info = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = std::filesystem::path(testing::TempDir()) / (std::string("mesh_") + info->name());
        std::filesystem::remove_all(folder_);
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::string write(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name) << text;
        return (folder_ / name).string();
    }
    static std::string errorOf(const std::string& file, const MeshOptions& options = {}) {
        try {
            loadMesh(file, options);
        } catch (const MeshError& error) {
            return error.what();
        }
        return "no error";
    }
    std::filesystem::path folder_;
};

// Corners (0,0,0), (2,0,0), (0,1,0).
const char* const kTriangleObj = "v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n";

TEST_F(MeshFile, ReadsEveryFormatToTheSameTriangle) {
    const std::string files[] = {
        write("a.obj", kTriangleObj),
        write("a.off", "OFF\n3 1 0\n0 0 0\n2 0 0\n0 1 0\n3 0 1 2\n"),
        write("a.ply",
              "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
              "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
              "end_header\n0 0 0\n2 0 0\n0 1 0\n3 0 1 2\n"),
        write("a.stl",
              "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 1 0\n"
              "endloop\nendfacet\nendsolid a\n"),
        write("a.gltf", R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
          "nodes":[{"mesh":0}],
          "meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":4}]}],
          "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
          "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36}],
          "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[2,1,0]}]})"),
    };
    for (const auto& file : files) {
        SCOPED_TRACE(file);
        const TriangleMesh mesh = loadMesh(file);
        ASSERT_EQ(mesh.triangles.size(), 1U);
        EXPECT_DOUBLE_EQ(mesh.area(0), 1.0);
        EXPECT_TRUE(mesh.normal(0).isApprox(Eigen::Vector3d::UnitZ()));
        EXPECT_TRUE(bounds(mesh).max.isApprox(Eigen::Vector3d(2, 1, 0)));
    }
}

TEST_F(MeshFile, TrianglesOfAnStlShareTheirVertices) {
    const TriangleMesh mesh = loadMesh(
        write("roof.stl",
              "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
              "endloop\nendfacet\nfacet normal 0 1 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\n"
              "vertex 1 0 0\nendloop\nendfacet\nendsolid a\n"));
    EXPECT_EQ(mesh.triangles.size(), 2U);
    EXPECT_EQ(mesh.vertices.size(), 4U);
}

TEST_F(MeshFile, ScalesAboutItsOwnOrigin) {
    const std::string file = write("a.obj", "v 1 0 0\nv 3 0 0\nv 1 1 0\nf 1 2 3\n");
    MeshOptions options;
    options.scale = 0.5;
    EXPECT_TRUE(bounds(loadMesh(file, options)).min.isApprox(Eigen::Vector3d(0.5, 0, 0)));
    options.size = 4;  // largest side 2 -> 4: twice as large, the origin stays where it is
    EXPECT_TRUE(bounds(loadMesh(file, options)).min.isApprox(Eigen::Vector3d(2, 0, 0)));
    EXPECT_TRUE(bounds(loadMesh(file, options)).max.isApprox(Eigen::Vector3d(6, 2, 0)));
}

TEST_F(MeshFile, TurnsYUpToZUp) {
    MeshOptions options;
    options.upAxis = MeshOptions::UpAxis::kY;
    const TriangleMesh mesh =
        loadMesh(write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), options);
    EXPECT_TRUE(bounds(mesh).max.isApprox(Eigen::Vector3d(1, 0, 1)));
    EXPECT_TRUE(mesh.normal(0).isApprox(-Eigen::Vector3d::UnitY()));  // was +z, towards the viewer
}

TEST_F(MeshFile, ReadsTexturesAndMaterials) {
    cv::imwrite((folder_ / "t.png").string(), cv::Mat(8, 8, CV_8UC3, cv::Scalar(10, 20, 30)));
    write("a.mtl", "newmtl paint\nKd 1 0.5 0\nmap_Kd t.png\n");
    const std::string file = write("a.obj",
                                   "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 "
                                   "1\nusemtl paint\nf 1/1 2/2 3/3\n");
    const TriangleMesh mesh = loadMesh(file);
    ASSERT_EQ(mesh.materialOf.size(), 1U);
    const Material& material = mesh.materials[mesh.materialOf[0]];
    EXPECT_EQ(material.name, "paint");
    ASSERT_FALSE(material.texture.empty());
    EXPECT_EQ(material.texture.at<cv::Vec3b>(3, 3), cv::Vec3b(10, 20, 30));
    ASSERT_EQ(mesh.uv.size(), mesh.vertices.size());

    MeshOptions options;
    options.maxTextureSize = 4;
    const TriangleMesh small = loadMesh(file, options);
    EXPECT_EQ(small.materials[small.materialOf[0]].texture.cols, 4);
    std::filesystem::remove(folder_ / "t.png");
    EXPECT_THAT(errorOf(file), AllOf(HasSubstr("t.png"), HasSubstr("missing")));
    options.textures = false;
    EXPECT_EQ(loadMesh(file, options).triangles.size(), 1U);
}

TEST_F(MeshFile, NamesWhatIsWrongOnOneLine) {
    MeshOptions huge;
    huge.scale = 10'000;
    const std::pair<std::string, std::string> cases[] = {
        {errorOf((folder_ / "none.ply").string()), "none.ply: no such file"},
        {errorOf(folder_.string()), "not a file"},
        {errorOf(write("text.obj", "hello\n")), "text.obj"},
        {errorOf(write("unknown.xyz123", "hello\n")), "unknown.xyz123"},
        {errorOf(write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n")), "points.obj"},
        {errorOf(write("points.ply",
                       "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                       "property float y\nproperty float z\nend_header\n0 0 0\n")),
         "points.ply"},
        {errorOf(write("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")), "not finite"},
        {errorOf(write("nan.off", "OFF\n3 1 0\n0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n")), "not finite"},
        {errorOf(write("ok.obj", kTriangleObj), huge), "2 km"},
        {errorOf(write("big.obj", "v 0 0 0\nv 10000 0 0\nv 0 1 0\nf 1 2 3\n")), "1e+04 m across"},
    };
    for (const auto& [message, expected] : cases) {
        EXPECT_THAT(message, AllOf(HasSubstr(expected), Not(HasSubstr("\n")), Not("no error")));
    }
}

TEST(Mesh, AppendKeepsMaterialsApart) {
    TriangleMesh a;
    a.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    a.triangles = {{0, 1, 2}};
    TriangleMesh b = a;
    b.materials.resize(2);
    b.materials[1].name = "second";
    b.materialOf = {1};
    b.uv.assign(3, {0.5F, 0.5F});
    append(a, b);
    ASSERT_EQ(a.triangles.size(), 2U);
    EXPECT_EQ(a.triangles[1][0], 3U);
    EXPECT_EQ(a.materials[a.materialOf[1]].name, "second");
    EXPECT_EQ(a.materials[a.materialOf[0]].name, "");
    EXPECT_EQ(a.uv.size(), 6U);
    EXPECT_DOUBLE_EQ(area(a), 1.0);
}

TEST(Mesh, HashSeesEveryCoordinateAndIndex) {
    TriangleMesh a;
    a.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    a.triangles = {{0, 1, 2}};
    TriangleMesh b = a;
    EXPECT_EQ(hashOf(a), hashOf(b));
    b.vertices[2].z() = 1e-6F;
    EXPECT_NE(hashOf(a), hashOf(b));
    b = a;
    b.triangles[0] = {1, 0, 2};
    EXPECT_NE(hashOf(a), hashOf(b));
}

}  // namespace
}  // namespace riftmap
