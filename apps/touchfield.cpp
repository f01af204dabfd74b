#include <cstdlib>
#include <unistd.h>

#include "apps/commands/program.h"
#include "sim/core/program_start.h"

namespace {

void end_without_room(int /*argc*/, char** /*argv*/, char** environment) {
  const std::string missing = touchfield::missing_room(environment);
  if (!missing.empty()) {
    const std::string line = "touchfield: error: " + missing + "\n";
    static_cast<void>(!write(STDERR_FILENO, line.data(), line.size()));
    _exit(EXIT_FAILURE);
  }
}

// Before the libraries' own start, in which OpenBLAS would hang.
[[gnu::section(".preinit_array"), gnu::used]] void (*const kFirst)(int, char**, char**) = end_without_room;

}  // namespace

int main(int argc, char** argv) { return touchfield::run_program(argc, argv); }
