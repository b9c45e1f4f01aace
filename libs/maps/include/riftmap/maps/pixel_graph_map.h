// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/CMetricMap.h>
#include <mrpt/maps/TMetricMapInitializer.h>
#include <mrpt/serialization/CSerializable.h>

#include <memory>
#include <optional>
#include <string>

#include "riftmap/graph/pixel_graph.h"
#include "riftmap/stereo/stereo_options.h"

namespace riftmap {

/// The pixel graph as a metric map of MRPT: made from INI by mrpt::maps::CMultiMetricMap, fed with
/// CObservationStereoImages, serialised, drawn and saved like MRPT's own maps. In INI files it is
/// `pixelGraph` (`pixelGraph_count = 1`); the keys of section [Graph] go into
/// `..._pixelGraph_00_creationOpts`, those of [Stereo] into `..._pixelGraph_00_insertOpts`. An
/// unknown key or a wrong value there throws (MRPT rethrows it as an exception of its own).
///
/// A program that does not know this class learns it from libriftmap-maps.so by LD_PRELOAD or as a
/// plug-in; one that links it calls registerPixelGraphMap() once, so that the linker keeps it.
///
/// Copying copies the graph. Not thread-safe while it is written to.
class PixelGraphMap : public mrpt::maps::CMetricMap {
    DEFINE_SERIALIZABLE(PixelGraphMap, riftmap)

 public:
    explicit PixelGraphMap(const GraphOptions& graph = {}, const StereoOptions& stereo = {});
    explicit PixelGraphMap(PixelGraph graph, const StereoOptions& stereo = {});
    ~PixelGraphMap() override;
    PixelGraphMap(const PixelGraphMap& other);
    PixelGraphMap& operator=(const PixelGraphMap& other);

    const PixelGraph& graph() const { return graph_; }
    PixelGraph& graph() { return graph_; }
    const StereoOptions& stereoOptions() const { return stereo_; }

    bool isEmpty() const override;
    std::string asString() const override;
    /// Appends points, high edges and rifts; nothing if genericMapParams.enableSaveAs3DObject is
    /// off.
    void getVisualizationInto(mrpt::opengl::CSetOfObjects& out) const override;
    /// Writes PREFIX.ply, PREFIX.3Dscene and PREFIX.pixelgraph. Throws FileError.
    void saveMetricMapRepresentationToFile(const std::string& prefix) const override;

    MAP_DEFINITION_START(PixelGraphMap)
    GraphOptions graphOptions;    ///< ..._creationOpts
    StereoOptions stereoOptions;  ///< ..._insertOpts
    MAP_DEFINITION_END(PixelGraphMap)

 private:
    struct Input;

    void internal_clear() override;
    /// Takes CObservationStereoImages with a right image, raw or rectified; false for any other.
    /// Throws std::invalid_argument for one that makes no sense; the map is unchanged then.
    bool internal_insertObservation(
        const mrpt::obs::CObservation& observation,
        const std::optional<const mrpt::poses::CPose3D>& robotPose) override;
    double internal_computeObservationLikelihood(
        const mrpt::obs::CObservation& observation,
        const mrpt::poses::CPose3D& takenFrom) const override;
    bool internal_canComputeObservationLikelihood(
        const mrpt::obs::CObservation& observation) const override;

    PixelGraph graph_;
    StereoOptions stereo_;
    std::unique_ptr<Input> input_;  ///< buffers of the matcher, made when first needed
};

/// Makes PixelGraphMap known to MRPT's archives and map factories; harmless when repeated.
void registerPixelGraphMap();

}  // namespace riftmap
