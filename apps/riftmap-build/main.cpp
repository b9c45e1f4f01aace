// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/build_program.h"

int main(int argc, char** argv) {
    riftmap::BuildProgram program;
    return riftmap::runProgram(program, argc, argv);
}
