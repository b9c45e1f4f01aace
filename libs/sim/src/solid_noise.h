// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace riftmap {

/// Points at which solid noise is wanted, as structure of arrays.
struct NoiseQueries {
    std::vector<float> x, y, z;    ///< [m]
    std::vector<float> size;       ///< of the coarsest blotches [m], > 0
    std::vector<float> footprint;  ///< of the pixel [m], > 0

    void resize(std::size_t count);
    void set(std::size_t i, const Eigen::Vector3f& point, float blotchSize, float pixelFootprint) {
        x[i] = point.x();
        y[i] = point.y();
        z[i] = point.z();
        size[i] = blotchSize;
        footprint[i] = pixelFootprint;
    }
    std::size_t count() const { return x.size(); }
};

/// Band-limited value noise in space: octaves of about equal contrast, as natural scenes have them,
/// so that there is something to match at any distance; the coarsest are held back. Octaves that a
/// pixel cannot resolve fade out. Mean 0, about -1 .. 1. The same bits on every machine: vector
/// code (dispatched at run time) without fused operations. Queries are padded, hence not const.
void solidNoise(NoiseQueries& queries, std::vector<float>& noise);

inline constexpr std::size_t kNoiseOctaves = 14;
/// The lattice of octave i is turned by this: no lines along walls.
const Eigen::Matrix3f& noiseRotation(std::size_t octave);
/// Contrast of octave i where it is fully resolved.
float noiseContrast(std::size_t octave);

}  // namespace riftmap
