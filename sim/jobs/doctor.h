#pragma once

#include <string>
#include <vector>

namespace touchfield {

/// One line about this machine and installation.
struct Finding {
  std::string subject;  // "processor", "BLAS", "pictures", ...
  std::string state;    // what there is
  std::string advice;   // empty, or what makes runs slow or incomplete and how to mend it
};

/// Examines everything that decides how fast and how completely runs work here. Hardware: processor and instruction
/// level, threads and cores, speed (an LU of about half a second), memory, disk, graphics card. Software: the program's
/// build, BLAS core and its threads, libraries, pictures (their font).
///
/// threads   in use
std::vector<Finding> examine_machine(int threads);

}  // namespace touchfield
