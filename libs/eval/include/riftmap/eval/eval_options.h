// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "riftmap/core/options.h"

namespace riftmap {

/// Which row of the protocol's table of distances applies.
enum class WorldKind {
    kAuto,     ///< by the mesh's largest side: up to 2.5 m an object, up to 25 m indoor
    kObject,   ///< 2, 5, 10 mm; headline 5 mm; 10,000 samples
    kIndoor,   ///< 1, 2, 5 cm; headline 2 cm; a sample a cm^2, at least 200,000
    kOutdoor,  ///< 5, 10 cm; headline 10 cm; samples as indoor
};

/// Section [Eval].
struct EvalOptions {
    WorldKind kind = WorldKind::kAuto;
    std::vector<double> deltas;    ///< [m]; empty = by the kind
    double headline = 0;           ///< [m]; 0 = by the kind
    int samples = 0;               ///< of the mesh; 0 = by the kind
    int maxSamples = 2000000;      ///< bound of the rule "one a cm^2"
    std::uint64_t sampleSeed = 1;  ///< of the samples: part of the protocol, not of a run
    double maxIncidence = 1.3089969389957472;  ///< [rad] (75 degrees)
    double grid = 0;        ///< spacing of the camera positions [m]; 0 = by the clearance
    int directions = 1024;  ///< cast from a sample before it is called unobservable
    std::string cache;  ///< directory for observable sets; empty = none (programs: a temporary one)
    bool strict = true;  ///< strict coverage too (needs normals)
    void describe(OptionTable& table);
    /// For programs: an empty `cache` becomes a directory of this user's among the temporary files,
    /// "none" becomes empty.
    void resolveCache();
};

}  // namespace riftmap
