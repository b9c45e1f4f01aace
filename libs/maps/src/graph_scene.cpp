// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/maps/graph_scene.h"

#include <mrpt/math/TPose3D.h>
#include <mrpt/opengl/CArrow.h>
#include <mrpt/opengl/COpenGLScene.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <mrpt/opengl/CSphere.h>

#include <algorithm>
#include <array>
#include <string>

#include "riftmap/core/file.h"

namespace riftmap {
namespace {

mrpt::math::TPoint3D point(const Eigen::Vector3d& p) {
    return {p.x(), p.y(), p.z()};
}

mrpt::math::TPoint3D point(const Eigen::Vector3f& p) {
    return point(p.cast<double>().eval());
}

/// The corners of a camera's image at distance `size`, then the camera itself.
std::array<mrpt::math::TPoint3D, 5> pyramid(const Pose& pose, double size) {
    const double w = 0.5 * size;
    const double h = 0.35 * size;
    return {point(pose * Eigen::Vector3d(-w, -h, size)), point(pose * Eigen::Vector3d(w, -h, size)),
            point(pose * Eigen::Vector3d(w, h, size)), point(pose * Eigen::Vector3d(-w, h, size)),
            point(pose.translation)};
}

}  // namespace

EdgeColour edgeColour(float weight, float high) {
    const float s = high > 0 ? std::clamp(weight / high, 0.0F, 1.0F) : 1.0F;
    return {std::min(1.0F, 2 * s), std::min(1.0F, 2 - 2 * s), 0.0F};
}

void addGraph(mrpt::opengl::CSetOfObjects& scene, const PixelGraph& graph) {
    auto cloud = mrpt::opengl::CPointCloudColoured::Create();
    cloud->setName("points");
    cloud->setPointSize(2.0F);
    cloud->reserve(graph.vertexCount());
    auto edges = mrpt::opengl::CSetOfLines::Create();
    edges->setName("high edges");
    edges->setColor_u8(255, 0, 0, 160);
    graph.forEachVertex([&](VertexId id) {
        const Vertex v = graph.vertex(id);
        constexpr float kUnit = 1.0F / 255.0F;
        cloud->push_back(v.position.x(), v.position.y(), v.position.z(),
                         static_cast<float>(v.rgb[0]) * kUnit, static_cast<float>(v.rgb[1]) * kUnit,
                         static_cast<float>(v.rgb[2]) * kUnit);
        graph.forEachEdge(id, [&](VertexId other, float /*weight*/, bool isHigh) {
            if (id < other && isHigh) {
                edges->appendLine(point(v.position), point(graph.position(other)));
            }
        });
    });
    scene.insert(cloud);
    scene.insert(edges);
}

void addRifts(mrpt::opengl::CSetOfObjects& scene, const std::vector<Rift>& rifts,
              std::optional<std::size_t> dominant, double length) {
    auto group = mrpt::opengl::CSetOfObjects::Create();
    group->setName("rifts");
    for (std::size_t i = 0; i < rifts.size(); ++i) {
        const Eigen::Vector3d centre = rifts[i].centre.cast<double>();
        const Eigen::Vector3d normal = rifts[i].normal.cast<double>();
        const bool isDominant = dominant == i;
        const double l = isDominant ? 2 * length : length;
        const mrpt::img::TColor colour =
            isDominant ? mrpt::img::TColor(255, 0, 0) : mrpt::img::TColor(30, 90, 255);
        const std::string name = "rift " + std::to_string(rifts[i].id);
        if (normal.norm() < 0.5) {  // none known, and MRPT cannot draw an arrow without length
            auto ball = mrpt::opengl::CSphere::Create(static_cast<float>(0.09 * l));
            ball->setLocation(point(centre));
            ball->setColor_u8(colour);
            ball->setName(name);
            group->insert(ball);
            continue;
        }
        auto arrow = mrpt::opengl::CArrow::Create();
        arrow->setArrowEnds(point(centre), point((centre + l * normal).eval()));
        arrow->setSmallRadius(static_cast<float>(0.03 * l));
        arrow->setLargeRadius(static_cast<float>(0.09 * l));
        arrow->setColor_u8(colour);
        arrow->setName(name);
        group->insert(arrow);
    }
    scene.insert(group);
}

void addCameraPath(mrpt::opengl::CSetOfObjects& scene, const char* name,
                   const std::vector<Pose>& world_T_camera, double size) {
    auto lines = mrpt::opengl::CSetOfLines::Create();
    lines->setName(name);
    lines->setColor_u8(0, 170, 0, 255);
    lines->setLineWidth(2.0F);
    for (std::size_t i = 0; i < world_T_camera.size(); ++i) {
        const auto corners = pyramid(world_T_camera[i], size);
        for (std::size_t k = 0; k < 4; ++k) {
            lines->appendLine(corners[k], corners[(k + 1) % 4]);
            lines->appendLine(corners[k], corners[4]);
        }
        if (i > 0) {
            lines->appendLine(point(world_T_camera[i - 1].translation), corners[4]);
        }
    }
    scene.insert(lines);
}

void saveScene(const std::filesystem::path& file, const PixelGraph& graph,
               const SceneExtras& extras) {
    auto all = mrpt::opengl::CSetOfObjects::Create();
    addGraph(*all, graph);
    constexpr double kArrow = 0.2;    // [m]
    constexpr double kPyramid = 0.1;  // [m]
    addRifts(*all, graph.rifts(), extras.dominant, kArrow);
    addCameraPath(*all, "camera path", extras.taken, kPyramid);
    addCameraPath(*all, "planned path", extras.planned, kPyramid);
    mrpt::opengl::COpenGLScene scene;
    scene.insert(all);
    writeBesideAndRename(file, [&](const std::filesystem::path& part) {
        if (!scene.saveToFile(part.string())) {
            throw FileError(file.string() + ": cannot be written");
        }
    });
}

}  // namespace riftmap
