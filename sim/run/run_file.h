#pragma once

#include <string>

#include "sim/run/archive_file.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// Version of the layout of run.h5; docs/run-file.md describes it.
inline constexpr int kRunFormatVersion = 6;

/// Writes a run as HDF5. The file appears under `path` whole or not at all (temporary name, flush, rename); an older
/// one is replaced. Groups that were not computed are absent.
///
/// throws   IoError naming the path and the system's reason; InputError if parts of the run do not fit each other or a
///          name of a method or field is not made of letters, digits, _ and -
void write_run_file(const std::string& path, const Run& run);

/// Reads a run back, as much of it as the file holds.
///
/// warn     as of read_archive
/// throws   InputError if the file is missing, is not a touchfield run, of a newer format version, damaged, or cannot
///          be read
Run read_run_file(const std::string& path, const Warn& warn = {});

/// The run.h5 that a user's path names: the file itself, or the directory that holds it.
std::string run_file_at(const std::string& path);

}  // namespace touchfield
