// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/simulate_program.h"

int main(int argc, char** argv) {
    riftmap::SimulateProgram program;
    return riftmap::runProgram(program, argc, argv);
}
