#pragma once

namespace touchfield {

/// The program: what the command line asks for, and its exit code.
int run_program(int argc, char** argv);

}  // namespace touchfield
