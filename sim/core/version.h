#pragma once

#include <ctime>
#include <filesystem>
#include <string>

namespace touchfield {

/// What this binary is; written into every result file.
struct BuildInfo {
  std::string version;     // of the project, e.g. 0.3.0
  std::string revision;    // git revision of the sources, "-dirty" if they differed from it
  std::string compiler;    // name and version
  std::string flags;       // of the build type
  std::string build_type;  // Release, Debug, ...
  std::string year;        // of the release, by CITATION.cff
};

BuildInfo build_info();

/// throws   InputError naming the release that reads the file, unless its format version is the one of this program
void require_format(const std::string& path, int version, int own);

/// Host name, processor and core count of the machine this runs on, in one line.
std::string machine_description();

/// The present time in UTC, ISO 8601 to the second.
std::string utc_now();

/// The file that this very code is in: libtouchfield.so in a program of another's, otherwise the program. What is
/// installed with it is found from there.
std::filesystem::path own_binary();

/// [s] of a clock that never jumps and continues while the machine sleeps, which std::chrono::steady_clock does not.
inline double steady_now() {
  timespec now{};
  ::clock_gettime(CLOCK_BOOTTIME, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace touchfield
