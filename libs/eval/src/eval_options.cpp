// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/eval_options.h"

#include <unistd.h>

#include <filesystem>

namespace riftmap {

void EvalOptions::describe(OptionTable& table) {
    table.section("Eval", "How a map is judged against the world (doc/coverage_protocol.md).");
    table.addChoice("kind", kind,
                    {{"auto", WorldKind::kAuto},
                     {"object", WorldKind::kObject},
                     {"indoor", WorldKind::kIndoor},
                     {"outdoor", WorldKind::kOutdoor}},
                    "Row of the protocol's table; auto goes by the largest side of the world "
                    "(2.5 m, 25 m).");
    table.add("deltas", deltas, 0, "m", "Distances coverage is taken at; empty: by the kind.");
    table.add("headline", headline, 0.0, 10.0, "m",
              "Distance of the pictures and of the explained share; 0: by the kind.");
    table.add("samples", samples, 0, 100000000, "",
              "Ground-truth samples; 0: 10,000 an object, else one a cm^2, at least 200,000.");
    table.add("max_samples", maxSamples, 1000, 100000000, "",
              "Upper bound of the rule of one sample a cm^2.");
    table.add("sample_seed", sampleSeed, "Seed of the ground-truth samples.");
    table.addDegrees("max_incidence_deg", maxIncidence, 1.0, 89.9,
                     "Steepest line of sight against the surface's normal that counts as seeing.");
    table.add("grid", grid, 0.0, 10.0, "m",
              "Spacing of the camera positions that reachability is flooded over; 0: half the "
              "clearance, within 2 and 10 cm.");
    table.add("directions", directions, 16, 65536, "",
              "Lines of sight a sample is tried along before it is called unobservable.");
    table.add(
        "cache", cache,
        "Directory that keeps observable sets between runs; none: no such; empty: one among the "
        "temporary files.");
    table.add("strict", strict, "Also coverage of the side seen, with nothing in between.");
}

void EvalOptions::resolveCache() {
    if (cache.empty()) {
        const std::string name = "riftmap-observable-" + std::to_string(getuid());
        cache = (std::filesystem::temp_directory_path() / name).string();
    } else if (cache == "none") {
        cache.clear();
    }
}

}  // namespace riftmap
