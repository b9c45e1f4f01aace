// SPDX-License-Identifier: BSD-3-Clause
// Vertices near a point, in vector code. The same bits on every machine.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "riftmap/graph/graph_storage.h"

namespace riftmap {

/// Squared distance of a slot's vertex [m^2].
inline float squaredDistance(const Page& page, std::uint32_t slot, const Eigen::Vector3f& point) {
    const float dx = page.x[slot] - point.x();
    const float dy = page.y[slot] - point.y();
    const float dz = page.z[slot] - point.z();
    return dx * dx + dy * dy + dz * dz;
}

/// The living vertices whose squaredDistance() is at most `squaredLimit` [m^2], a bit a slot.
std::uint64_t verticesWithin(const Page& page, const Eigen::Vector3f& point, float squaredLimit);

}  // namespace riftmap
