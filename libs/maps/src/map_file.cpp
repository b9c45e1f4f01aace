// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/maps/map_file.h"

#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/serialization/CArchive.h>

#include "riftmap/core/file.h"
#include "riftmap/core/text.h"

namespace riftmap {

void saveMap(const std::filesystem::path& file, const PixelGraphMap& map) {
    writeBesideAndRename(file, [&](const std::filesystem::path& part) {
        {
            mrpt::io::CFileGZOutputStream stream;
            std::string why;
            if (!stream.open(part.string(), 1, why)) {
                throw FileError(file.string() + ": cannot be written: " + oneLine(why));
            }
            mrpt::serialization::archiveFrom(stream) << map;
        }
        if (loadMap(part).graph().vertexCount() != map.graph().vertexCount()) {
            throw FileError(file.string() + ": not all of it arrived; is the disk full?");
        }
    });
}

PixelGraphMap loadMap(const std::filesystem::path& file) {
    registerPixelGraphMap();
    if (!std::filesystem::is_regular_file(file)) {
        throw FileError(file.string() + ": no such file");
    }
    try {
        mrpt::io::CFileGZInputStream stream(file.string());
        auto archive = mrpt::serialization::archiveFrom(stream);
        const auto object = archive.ReadObject();
        const auto map = std::dynamic_pointer_cast<PixelGraphMap>(object);
        if (!map) {
            throw FileError(std::string("holds a ") + object->GetRuntimeClass()->className +
                            ", not a PixelGraphMap");
        }
        return std::move(*map);
    } catch (const mrpt::serialization::CExceptionEOF&) {
        throw FileError(file.string() + ": empty or cut short");
    } catch (const std::exception& e) {
        throw FileError(file.string() + ": not a readable map: " + oneLine(e.what()));
    }
}

PointCloud cloudOf(const PixelGraph& graph) {
    PointCloud cloud;
    const auto n = graph.vertexCount();
    cloud.points.reserve(n);
    cloud.normals.reserve(n);
    cloud.colours.reserve(n);
    graph.forEachVertex([&](VertexId id) {
        const Vertex v = graph.vertex(id);
        cloud.points.push_back(v.position);
        cloud.normals.push_back(v.normal);
        cloud.colours.push_back(v.rgb);
    });
    return cloud;
}

}  // namespace riftmap
