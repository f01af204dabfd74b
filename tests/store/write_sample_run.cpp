#include <cstdio>
#include <exception>

#include "sim/store/run_file.h"
#include "tests/support/output_support.h"

/// Writes the runs that read_run_h5.py checks, with a judge of its own and without: write_sample_run FILE SELF_JUDGED
int main(int argc, char** argv) {
  if (argc != 3) {
    return 2;
  }
  try {
    touchfield::write_run_file(argv[1], touchfield::support::full_run());
    touchfield::write_run_file(argv[2], touchfield::support::self_judged_run());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
