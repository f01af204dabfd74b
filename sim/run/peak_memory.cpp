#include "sim/run/peak_memory.h"

#include <fstream>
#include <limits>
#include <malloc.h>
#include <string>

namespace touchfield {

bool reset_peak_memory() {
  malloc_trim(0);  // what is free goes back first, or it would count
  std::ofstream file("/proc/self/clear_refs");
  file << "5" << std::flush;
  return file.good();
}

double peak_memory_mib() {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.rfind("VmHWM:", 0) == 0) {
      return std::stod(line.substr(6)) / 1024.0;
    }
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace touchfield
