// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/import_program.h"

int main(int argc, char** argv) {
    riftmap::ImportProgram program;
    return riftmap::runProgram(program, argc, argv);
}
