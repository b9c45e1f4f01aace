// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "riftmap/apps/program.h"

namespace riftmap {

/// One of each of Riftmap's programs, in the order of the alphabet.
std::vector<std::unique_ptr<Program>> allPrograms();

}  // namespace riftmap
