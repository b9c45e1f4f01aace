// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "merge.h"
#include "rift_finder.h"
#include "riftmap/graph/graph_storage.h"
#include "riftmap/graph/pixel_graph.h"

namespace riftmap {

class PixelGraph::Impl {
 public:
    explicit Impl(const GraphOptions& o) : options(o), storage(o.blockSize), rifts(o), merger(o) {}
    Impl(const Impl& other)
        : options(other.options),
          storage(other.storage),
          rifts(other.rifts),
          merger(other.options),
          rawPoints(other.rawPoints),
          area(other.area) {}
    Impl& operator=(const Impl&) = delete;
    ~Impl() = default;

    GraphOptions options;
    GraphStorage storage;
    RiftFinder rifts;
    Merger merger;
    std::size_t rawPoints = 0;
    std::int64_t area = 0;  ///< [compact::areaUnits]
};

}  // namespace riftmap
