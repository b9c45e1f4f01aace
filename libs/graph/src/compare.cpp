// SPDX-License-Identifier: BSD-3-Clause

#include <stdexcept>

#include "riftmap/core/parallel.h"
#include "riftmap/graph/pixel_graph.h"

namespace riftmap {
namespace {

struct OneWay {
    std::size_t alone = 0, met = 0;
    double distance = 0;
};

/// Page by page with sums in page order: the same result for any number of threads.
OneWay compareTo(const PixelGraph& a, const PixelGraph& b, float distance) {
    const GraphStorage& storage = a.storage();
    std::vector<OneWay> perPage(storage.pageCount());
    parallelFor(storage.pageCount(), 1, [&](std::size_t first, std::size_t) {
        const auto index = static_cast<std::uint32_t>(first);
        OneWay& sum = perPage[index];
        const Page& page = storage.page(index);
        forEachBit(page.alive, [&](std::uint32_t slot) {
            const Eigen::Vector3f p = page.position(slot);
            if (const auto partner = b.nearest(p, distance)) {
                ++sum.met;
                sum.distance += static_cast<double>((b.position(*partner) - p).norm());
            } else {
                ++sum.alone;
            }
        });
    });
    OneWay total;
    for (const OneWay& sum : perPage) {
        total.alone += sum.alone;
        total.met += sum.met;
        total.distance += sum.distance;
    }
    return total;
}

}  // namespace

GraphComparison compareGraphs(const PixelGraph& a, const PixelGraph& b, double distance) {
    if (!(distance > 0)) {
        throw std::invalid_argument("compareGraphs: distance = " + std::to_string(distance) +
                                    ", allowed: > 0");
    }
    const OneWay ab = compareTo(a, b, static_cast<float>(distance));
    const OneWay ba = compareTo(b, a, static_cast<float>(distance));
    GraphComparison result;
    result.verticesA = a.vertexCount();
    result.verticesB = b.vertexCount();
    result.onlyInA = ab.alone;
    result.onlyInB = ba.alone;
    const std::size_t met = ab.met + ba.met;
    result.meanDistance = met == 0 ? 0 : (ab.distance + ba.distance) / static_cast<double>(met);
    return result;
}

}  // namespace riftmap
