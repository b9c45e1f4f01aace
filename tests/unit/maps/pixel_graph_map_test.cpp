// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/maps/pixel_graph_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/config/CConfigFileMemory.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationStereoImages.h>
#include <mrpt/opengl/CArrow.h>
#include <mrpt/opengl/COpenGLScene.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <mrpt/opengl/CSphere.h>
#include <mrpt/serialization/CArchive.h>

#include <numbers>
#include <sstream>

#include "riftmap/core/file.h"
#include "riftmap/core/mrpt_time.h"
#include "riftmap/core/ply.h"
#include "riftmap/maps/graph_scene.h"
#include "riftmap/maps/map_file.h"
#include "temporary_folder.h"
#include "textured_pair.h"

namespace riftmap {
namespace {

using test::messageOf;
using ::testing::HasSubstr;

/// What observations2map and others read.
constexpr const char* kIni = R"([MappingApplication]
pixelGraph_count = 1
[MappingApplication_pixelGraph_00_creationOpts]
target_resolution = 0.05
enableObservationLikelihood = false
[MappingApplication_pixelGraph_00_insertOpts]
num_disparities = 16
matcher = opencv_bm
)";

mrpt::maps::TSetOfMetricMapInitializers definitions(const std::string& ini) {
    registerPixelGraphMap();
    mrpt::maps::TSetOfMetricMapInitializers result;
    result.loadFromConfigFile(mrpt::config::CConfigFileMemory(ini), "MappingApplication");
    return result;
}

/// The pair as a camera that looks along x of the robot records it.
mrpt::obs::CObservationStereoImages observation() {
    const auto pair = test::texturedPair(0);
    mrpt::obs::CObservationStereoImages o;
    o.imageLeft = mrpt::img::CImage(pair.left, mrpt::img::DEEP_COPY);
    o.imageRight = mrpt::img::CImage(pair.right, mrpt::img::DEEP_COPY);
    o.hasImageRight = true;
    o.timestamp = toMrptTime(0);
    for (auto* camera : {&o.leftCamera, &o.rightCamera}) {
        camera->ncols = 160;
        camera->nrows = 120;
        camera->setIntrinsicParamsFromValues(100, 100, pair.camera.cx, pair.camera.cy);
    }
    constexpr double kQuarter = std::numbers::pi / 2;
    o.cameraPose =
        mrpt::poses::CPose3DQuat(mrpt::poses::CPose3D(0, 0, 0.5, -kQuarter, 0, -kQuarter));
    o.rightCameraPose = mrpt::poses::CPose3DQuat(mrpt::poses::CPose3D(0.1, 0, 0, 0, 0, 0));
    return o;
}

StereoOptions sixteenDisparities() {
    StereoOptions options;
    options.numDisparities = 16;
    return options;
}

TEST(PixelGraphMap, IsMadeOnceFromIniAndFedWithRobotPose) {
    mrpt::maps::CMultiMetricMap maps(definitions(kIni));
    ASSERT_EQ(maps.maps.size(), 1U) << "an alias that MRPT takes for the class name makes two";
    const auto map = maps.mapByClass<PixelGraphMap>();
    ASSERT_TRUE(map);
    EXPECT_EQ(map->graph().options().targetResolution, 0.05);
    EXPECT_EQ(map->stereoOptions().matcher, MatcherKind::kOpenCvBlock);
    EXPECT_TRUE(map->isEmpty());

    // The robot stands at x = 10 m and looks to the left.
    const auto pose = std::make_optional<const mrpt::poses::CPose3D>(
        10.0, 0.0, 0.0, std::numbers::pi / 2, 0.0, 0.0);
    EXPECT_TRUE(maps.insertObservation(observation(), pose));
    EXPECT_GT(map->graph().vertexCount(), 1000U);
    std::size_t onWallOrSquare = 0;
    map->graph().forEachVertex([&](VertexId id) {
        const auto p = map->graph().position(id);
        onWallOrSquare += std::abs(p.y() - 2.5F) < 0.1F || std::abs(p.y() - 1.0F) < 0.1F ? 1 : 0;
        EXPECT_NEAR(p.x(), 10.0F, 3.0F);
    });
    EXPECT_GT(onWallOrSquare, map->graph().vertexCount() * 95 / 100);

    EXPECT_FALSE(maps.insertObservation(mrpt::obs::CObservation2DRangeScan()));
    EXPECT_FALSE(map->canComputeObservationLikelihood(observation()));
    maps.clear();
    EXPECT_TRUE(map->isEmpty());
}

TEST(PixelGraphMap, WrongKeysAndValuesAreNamed) {
    const std::string ini = kIni;
    EXPECT_THAT(messageOf<std::exception>([&] { definitions(ini + "num_disparites = 3\n"); }),
                ::testing::AllOf(HasSubstr("num_disparites"), HasSubstr("'num_disparities'")));
    EXPECT_THAT(messageOf<std::exception>([&] { definitions(ini + "window = wide\n"); }),
                HasSubstr("wide"));
}

TEST(PixelGraphMap, SurvivesSerialisationInsideAMultiMap) {
    mrpt::maps::CMultiMetricMap maps(definitions(kIni));
    maps.insertObservation(observation());
    const auto map = maps.mapByClass<PixelGraphMap>();
    map->genericMapParams.enableSaveAs3DObject = false;

    mrpt::io::CMemoryStream memory;
    auto archive = mrpt::serialization::archiveFrom(memory);
    archive << maps;
    memory.Seek(0);
    mrpt::maps::CMultiMetricMap again;
    archive >> again;
    const auto copy = again.mapByClass<PixelGraphMap>();
    ASSERT_TRUE(copy);
    EXPECT_EQ(copy->graph().edgeCount(), map->graph().edgeCount());
    EXPECT_EQ(copy->graph().rifts().size(), map->graph().rifts().size());
    EXPECT_EQ(copy->stereoOptions().numDisparities, 16);
    EXPECT_FALSE(copy->genericMapParams.enableSaveAs3DObject);
    std::ostringstream a;
    std::ostringstream b;
    map->graph().save(a);
    copy->graph().save(b);
    EXPECT_EQ(a.str(), b.str());
    // It goes on as the original would: the same view again adds nothing.
    EXPECT_TRUE(copy->insertObservation(observation()));
    EXPECT_EQ(copy->graph().vertexCount(), map->graph().vertexCount());
}

TEST(PixelGraphMap, CopiesAreIndependent) {
    PixelGraphMap map(GraphOptions{}, sixteenDisparities());
    map.insertObservation(observation());
    PixelGraphMap copy(map);
    map.clear();
    EXPECT_TRUE(map.isEmpty());
    EXPECT_GT(copy.graph().vertexCount(), 1000U);
    map = copy;
    EXPECT_EQ(map.graph().vertexCount(), copy.graph().vertexCount());
}

TEST(PixelGraphMap, AnObservationThatMakesNoSenseChangesNothing) {
    PixelGraphMap map(GraphOptions{}, sixteenDisparities());
    auto bad = observation();
    bad.imageRight = mrpt::img::CImage(80, 60, mrpt::img::CH_GRAY);
    EXPECT_THROW(map.insertObservation(bad), std::invalid_argument);
    EXPECT_TRUE(map.isEmpty());
    bad.hasImageRight = false;
    EXPECT_FALSE(map.insertObservation(bad));
}

TEST(PixelGraphMap, IsDrawnWithStockObjectsUnlessThatIsOff) {
    PixelGraphMap map(GraphOptions{}, sixteenDisparities());
    map.insertObservation(observation());
    mrpt::opengl::CSetOfObjects drawn;
    map.getVisualizationInto(drawn);
    const auto cloud = drawn.getByClass<mrpt::opengl::CPointCloudColoured>();
    ASSERT_TRUE(cloud);
    EXPECT_EQ(cloud->size(), map.graph().vertexCount());
    map.genericMapParams.enableSaveAs3DObject = false;
    mrpt::opengl::CSetOfObjects none;
    map.getVisualizationInto(none);
    EXPECT_TRUE(none.empty());
}

TEST(PixelGraphMap, SavesPointsSceneAndItself) {
    const test::TemporaryFolder folder;
    PixelGraphMap map(GraphOptions{}, sixteenDisparities());
    map.insertObservation(observation());
    map.saveMetricMapRepresentationToFile((folder / "m").string());
    EXPECT_EQ(readPly(folder / "m.ply").points.size(), map.graph().vertexCount());
    mrpt::opengl::COpenGLScene scene;
    EXPECT_TRUE(scene.loadFromFile((folder / "m.3Dscene").string()));
    EXPECT_EQ(loadMap(folder / "m.pixelgraph").graph().edgeCount(), map.graph().edgeCount());
}

TEST(GraphScene, ARiftWithoutNormalIsABall) {
    // MRPT throws on drawing an arrow of no length, and then SceneViewer3D shows nothing at all.
    std::vector<Rift> rifts(2);
    rifts[1].normal = {0, 0, 1};
    mrpt::opengl::CSetOfObjects scene;
    addRifts(scene, rifts, std::size_t{1}, 0.2);
    const auto group = scene.getByClass<mrpt::opengl::CSetOfObjects>();
    ASSERT_TRUE(group);
    EXPECT_TRUE(group->getByClass<mrpt::opengl::CSphere>(0));
    EXPECT_TRUE(group->getByClass<mrpt::opengl::CArrow>(0));
    EXPECT_FALSE(group->getByClass<mrpt::opengl::CArrow>(1));
}

TEST(MapFile, DamageIsNamed) {
    const test::TemporaryFolder folder;
    PixelGraphMap map(GraphOptions{}, sixteenDisparities());
    map.insertObservation(observation());
    saveMap(folder / "m.pixelgraph", map);
    const auto bytes = readFile(folder / "m.pixelgraph");
    folder.write("cut.pixelgraph", bytes.substr(0, bytes.size() / 2));
    folder.write("empty.pixelgraph", "");
    for (const auto* name : {"cut.pixelgraph", "empty.pixelgraph", "none.pixelgraph"}) {
        EXPECT_THAT(messageOf<FileError>([&] { loadMap(folder / name); }), HasSubstr(name));
    }
}

TEST(EdgeColour, RunsFromGreenOverYellowToRed) {
    const auto low = edgeColour(0, 1);
    EXPECT_EQ(low.green, 1);
    EXPECT_EQ(low.red, 0);
    const auto middle = edgeColour(0.5F, 1);
    EXPECT_EQ(middle.green, 1);
    EXPECT_EQ(middle.red, 1);
    const auto high = edgeColour(7, 1);
    EXPECT_EQ(high.green, 0);
    EXPECT_EQ(high.red, 1);
}

}  // namespace
}  // namespace riftmap
