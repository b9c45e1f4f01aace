// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "riftmap/sim/world.h"

namespace riftmap {

World makeRoom();       ///< 6 x 5 x 2.7 m, furnished
World makeRooms();      ///< five rooms along a corridor, 12 x 9 x 2.6 m
World makeCourtyard();  ///< about 40 x 36 m, facades with arches and alleys, open above
World makeSculpture();  ///< about 1 m: concave, with holes and thin parts
World makePlane();      ///< a floor of 6 x 6 m
World makeSteps();      ///< that floor with blocks and a staircase

}  // namespace riftmap
