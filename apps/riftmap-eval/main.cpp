// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/eval_program.h"

int main(int argc, char** argv) {
    riftmap::EvalProgram program;
    return riftmap::runProgram(program, argc, argv);
}
