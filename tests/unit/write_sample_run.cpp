#include <cstdio>
#include <exception>

#include "sim/output/run_file.h"
#include "tests/unit/output_support.h"

/// Writes the run that read_run_h5.py checks: write_sample_run FILE
int main(int argc, char** argv) {
  if (argc != 2) {
    return 2;
  }
  try {
    touchfield::write_run_file(argv[1], touchfield::support::full_run());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
