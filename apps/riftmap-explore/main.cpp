// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/explore_program.h"

int main(int argc, char** argv) {
    riftmap::ExploreProgram program;
    return riftmap::runProgram(program, argc, argv);
}
