#include <cstdio>
#include <exception>

#include "sim/run/motion_file.h"
#include "sim/run/run_file.h"
#include "tests/support/motion_support.h"

/// Writes the files that tests in Python read: runs with an evaluation of its own and without, and a motion.
/// write_sample_run RUN SELF_EVALUATED MOTION
int main(int argc, char** argv) {
  if (argc != 4) return 2;
  try {
    touchfield::write_run_file(argv[1], touchfield::support::full_run());
    touchfield::write_run_file(argv[2], touchfield::support::self_evaluated_run());
    touchfield::write_motion_file(argv[3], touchfield::support::full_motion());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
