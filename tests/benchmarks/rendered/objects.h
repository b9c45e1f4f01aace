// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <string>

#include "riftmap/sim/world.h"
#include "riftmap/stereo/stereo_options.h"

namespace riftmap {

/// How far single matches lie from the surface of an object of about a metre that stands alone,
/// seen from 1 to 1.7 m (noise level N4): beside silhouettes, at grazing incidence and elsewhere,
/// and how well sigma tells it. Prints a line for each and writes `figure,value,unit` to `csv`.
void scoreObject(const std::string& name, const WorldOptions& world, const StereoOptions& options,
                 std::ostream& csv);

}  // namespace riftmap
