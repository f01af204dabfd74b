#include "apps/commands/program.h"

int main(int argc, char** argv) { return touchfield::run_program(argc, argv); }
