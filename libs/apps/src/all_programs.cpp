// SPDX-License-Identifier: BSD-3-Clause
#include "all_programs.h"

#include "riftmap/apps/build_program.h"
#include "riftmap/apps/disparity_program.h"
#include "riftmap/apps/eval_program.h"
#include "riftmap/apps/explore_program.h"
#include "riftmap/apps/import_program.h"
#include "riftmap/apps/info_program.h"
#include "riftmap/apps/simulate_program.h"

namespace riftmap {

std::vector<std::unique_ptr<Program>> allPrograms() {
    std::vector<std::unique_ptr<Program>> programs;
    programs.push_back(std::make_unique<BuildProgram>());
    programs.push_back(std::make_unique<DisparityProgram>());
    programs.push_back(std::make_unique<EvalProgram>());
    programs.push_back(std::make_unique<ExploreProgram>());
    programs.push_back(std::make_unique<ImportProgram>());
    programs.push_back(std::make_unique<InfoProgram>());
    programs.push_back(std::make_unique<SimulateProgram>());
    return programs;
}

}  // namespace riftmap
