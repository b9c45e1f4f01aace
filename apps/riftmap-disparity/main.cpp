// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/disparity_program.h"

int main(int argc, char** argv) {
    riftmap::DisparityProgram program;
    return riftmap::runProgram(program, argc, argv);
}
