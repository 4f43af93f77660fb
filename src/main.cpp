#include "cli/command_line.h"

int main(int argc, char** argv) { return polymorph::run_program(argc, argv); }
