#pragma once

#include <string>

namespace touchfield {

/// Flags that every command takes.
struct CommonFlags {
  int threads = 0;     // 0: as many as the machine offers (or OMP_NUM_THREADS)
  bool quiet = false;  // errors and results only
  bool json = false;   // results as JSON on standard output
};

/// Sets the number of threads of our loops and of OpenBLAS; returns the number in use.
int apply_threads(const CommonFlags& flags);

/// The run.h5 that a path on the command line names: the file itself, or the directory that holds it.
std::string run_file_at(const std::string& path);

/// throws   InputError if there is a file of the name that the command is to write and --force does not replace it
void require_free_output(const std::string& path, bool force);

/// The command as it was typed, for provenance.
std::string joined_command_line(int argc, char** argv);

}  // namespace touchfield
