#include "apps/commands/command_line.h"

#include <filesystem>

#include <fmt/format.h>
#include <omp.h>

#include "sim/core/errors.h"

namespace touchfield {

int apply_threads(const CommonFlags& flags) {
  if (flags.threads > 0) {
    omp_set_num_threads(flags.threads);  // the OpenMP flavour of OpenBLAS follows
  }
  return omp_get_max_threads();
}

std::string run_file_at(const std::string& path) {
  return std::filesystem::is_directory(path) ? (std::filesystem::path(path) / "run.h5").string() : path;
}

void require_free_output(const std::string& path, bool force) {
  std::error_code error;
  if (!force && std::filesystem::exists(std::filesystem::symlink_status(path, error))) {
    throw InputError(
        fmt::format("{}: there is a file of that name; give another with -o, or --force to replace it", path));
  }
}

std::string joined_command_line(int argc, char** argv) {
  std::string line;
  for (int i = 0; i < argc; ++i) {
    const std::string word = argv[i];
    const bool plain = !word.empty() && word.find_first_of(" \t\n'\"\\$*?[]{}()<>|&;#~`!") == std::string::npos;
    std::string quoted = word;
    if (!plain) {
      quoted = "'";
      for (const char c : word) {
        quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
      }
      quoted += "'";
    }
    line += (i > 0 ? " " : "") + quoted;
  }
  return line;
}

}  // namespace touchfield
