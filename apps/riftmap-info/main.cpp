// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/info_program.h"

int main(int argc, char** argv) {
    riftmap::InfoProgram program;
    return riftmap::runProgram(program, argc, argv);
}
