// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/maps/pixel_graph_map.h"

#include <mrpt/config/CConfigFileBase.h>
#include <mrpt/core/initializer.h>
#include <mrpt/obs/CObservationStereoImages.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <istream>
#include <ostream>
#include <stdexcept>

#include "archive_stream.h"
#include "riftmap/core/mrpt_time.h"
#include "riftmap/core/ply.h"
#include "riftmap/core/text.h"
#include "riftmap/maps/graph_scene.h"
#include "riftmap/maps/map_file.h"
#include "riftmap/stereo/rectifier.h"
#include "riftmap/stereo/view_builder.h"

namespace riftmap {

// The alias must differ from the class name by more than case: INI keys ignore case, and the map
// would be made twice.
MAP_DEFINITION_REGISTER("riftmap::PixelGraphMap,pixelGraph", riftmap::PixelGraphMap)
IMPLEMENTS_SERIALIZABLE(PixelGraphMap, CMetricMap, riftmap)

void registerPixelGraphMap() {
    mrpt::rtti::registerClass(CLASS_ID(PixelGraphMap));
}

MRPT_INITIALIZER(registerAllClasses_riftmap_maps) {
    registerPixelGraphMap();
}

namespace {

/// MRPT reads these itself, from ..._creationOpts.
const std::vector<std::string> kGenericKeys = {
    "enableSaveAs3DObject", "enableObservationLikelihood", "enableObservationInsertion"};

/// Reads a section of MRPT's configuration into a table of options. Throws ConfigError.
void load(OptionTable& table, const mrpt::config::CConfigFileBase& source,
          const std::string& section) {
    std::vector<std::string> known = kGenericKeys;
    for (const auto& option : table.options()) {
        known.push_back(option.key);
    }
    std::vector<std::string> keys;
    source.getAllKeys(section, keys);
    for (const auto& key : keys) {
        const auto same = [&](const std::string& k) { return lower(k) == lower(key); };
        const auto found = std::find_if(known.begin(), known.end(), same);
        if (found == known.end()) {
            throw ConfigError(section + "." + key + ": unknown key; did you mean '" +
                              nearestName(key, known) + "'?");
        }
        const auto index = static_cast<std::size_t>(found - known.begin());
        if (index >= kGenericKeys.size()) {
            const auto& option = table.options()[index - kGenericKeys.size()];
            table.set(option.section + "." + option.key + "=" +
                      trimmed(source.read_string(section, key, "")));
        }
    }
}

void write(mrpt::serialization::CArchive& out, const OptionTable& table) {
    out.WriteAs<std::uint32_t>(table.options().size());
    for (const auto& option : table.options()) {
        out << option.section + "." + option.key + "=" + option.format();
    }
}

void read(mrpt::serialization::CArchive& in, OptionTable& table) {
    const auto n = in.ReadAs<std::uint32_t>();
    for (std::uint32_t i = 0; i < n; ++i) {
        std::string assignment;
        in >> assignment;
        table.set(assignment);
    }
}

}  // namespace

struct PixelGraphMap::Input {
    explicit Input(const StereoOptions& options) : builder(options) {}
    Rectifier rectifier;
    ViewBuilder builder;
};

PixelGraphMap::TMapDefinition::TMapDefinition() = default;

void PixelGraphMap::TMapDefinition::loadFromConfigFile_map_specific(
    const mrpt::config::CConfigFileBase& source, const std::string& sectionNamePrefix) {
    OptionTable graph;
    graphOptions.describe(graph);
    load(graph, source, sectionNamePrefix + "_creationOpts");
    OptionTable stereo;
    stereoOptions.describe(stereo);
    load(stereo, source, sectionNamePrefix + "_insertOpts");
}

void PixelGraphMap::TMapDefinition::dumpToTextStream_map_specific(std::ostream& out) const {
    auto copy = *this;
    OptionTable table;
    copy.graphOptions.describe(table);
    copy.stereoOptions.describe(table);
    out << table.dump();
}

mrpt::maps::CMetricMap* PixelGraphMap::internal_CreateFromMapDefinition(
    const mrpt::maps::TMetricMapInitializer& definition) {
    const auto& own = dynamic_cast<const PixelGraphMap::TMapDefinition&>(definition);
    return new PixelGraphMap(own.graphOptions, own.stereoOptions);  // MRPT 2 takes it over
}

PixelGraphMap::PixelGraphMap(const GraphOptions& graph, const StereoOptions& stereo)
    : graph_(graph), stereo_(stereo) {}

PixelGraphMap::PixelGraphMap(PixelGraph graph, const StereoOptions& stereo)
    : graph_(std::move(graph)), stereo_(stereo) {}

PixelGraphMap::~PixelGraphMap() = default;

PixelGraphMap::PixelGraphMap(const PixelGraphMap& other)
    : mrpt::maps::CMetricMap(other), graph_(other.graph_), stereo_(other.stereo_) {}

PixelGraphMap& PixelGraphMap::operator=(const PixelGraphMap& other) {
    if (this != &other) {
        mrpt::maps::CMetricMap::operator=(other);
        graph_ = other.graph_;
        stereo_ = other.stereo_;
        input_.reset();
    }
    return *this;
}

bool PixelGraphMap::isEmpty() const {
    return graph_.vertexCount() == 0;
}

std::string PixelGraphMap::asString() const {
    return "PixelGraphMap: " + std::to_string(graph_.vertexCount()) + " vertices, " +
           std::to_string(graph_.edgeCount()) + " edges, " + std::to_string(graph_.rifts().size()) +
           " rifts";
}

void PixelGraphMap::getVisualizationInto(mrpt::opengl::CSetOfObjects& out) const {
    if (genericMapParams.enableSaveAs3DObject) {
        addGraph(out, graph_);
        constexpr double kArrow = 0.2;  // [m]
        addRifts(out, graph_.rifts(), std::nullopt, kArrow);
    }
}

void PixelGraphMap::saveMetricMapRepresentationToFile(const std::string& prefix) const {
    writePly(prefix + ".ply", cloudOf(graph_));
    saveScene(prefix + ".3Dscene", graph_);
    saveMap(prefix + ".pixelgraph", *this);
}

void PixelGraphMap::internal_clear() {
    graph_.clear();
}

bool PixelGraphMap::internal_insertObservation(
    const mrpt::obs::CObservation& observation,
    const std::optional<const mrpt::poses::CPose3D>& robotPose) {
    const auto* pair = dynamic_cast<const mrpt::obs::CObservationStereoImages*>(&observation);
    if (pair == nullptr || !pair->hasImageRight) {
        return false;
    }
    if (!input_) {
        input_ = std::make_unique<Input>(stereo_);
    }
    pair->load();  // external images; the shallow copies below keep them
    cv::Mat left;
    cv::Mat right;
    pair->imageLeft.asCvMat(left, mrpt::img::SHALLOW_COPY);
    pair->imageRight.asCvMat(right, mrpt::img::SHALLOW_COPY);
    RectifiedPair rectified;
    input_->rectifier.rectify(pair->getStereoCameraParams(), left, right, rectified);

    StereoObservation input;
    input.time_ns = fromMrptTime(pair->timestamp);
    input.camera = rectified.camera;
    input.world_T_camera = fromMrpt(robotPose.value_or(mrpt::poses::CPose3D())) *
                           fromMrpt(mrpt::poses::CPose3D(pair->cameraPose)) *
                           rectified.raw_T_rectified;
    input.left = rectified.left;
    input.right = rectified.right;
    graph_.merge(input_->builder.build(input));
    pair->imageLeft.unload();
    pair->imageRight.unload();
    return true;
}

double PixelGraphMap::internal_computeObservationLikelihood(
    const mrpt::obs::CObservation& /*observation*/,
    const mrpt::poses::CPose3D& /*takenFrom*/) const {
    throw std::logic_error("PixelGraphMap gives no likelihood of observations");
}

bool PixelGraphMap::internal_canComputeObservationLikelihood(
    const mrpt::obs::CObservation& /*observation*/) const {
    return false;
}

uint8_t PixelGraphMap::serializeGetVersion() const {
    return 0;
}

void PixelGraphMap::serializeTo(mrpt::serialization::CArchive& out) const {
    out << genericMapParams;
    auto stereo = stereo_;
    OptionTable table;
    stereo.describe(table);
    write(out, table);
    ArchiveOutput buffer(out);
    std::ostream stream(&buffer);
    graph_.save(stream);
    buffer.finish();
}

void PixelGraphMap::serializeFrom(mrpt::serialization::CArchive& in, uint8_t version) {
    switch (version) {
        case 0: {
            in >> genericMapParams;
            StereoOptions stereo;
            OptionTable table;
            stereo.describe(table);
            read(in, table);
            ArchiveInput buffer(in);
            std::istream stream(&buffer);
            stream.exceptions(std::ios::badbit);
            PixelGraph graph;
            graph.load(stream);
            buffer.finish();
            graph_ = std::move(graph);
            stereo_ = stereo;
            input_.reset();
            break;
        }
        default:
            MRPT_THROW_UNKNOWN_SERIALIZATION_VERSION(version);
    }
}

}  // namespace riftmap
