#pragma once

#include <string>

#include "sim/core/json.h"
#include "sim/run/checksum.h"
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

/// The methods side by side, one per line, with the gap to the optimality bound where it was computed. If the metrics
/// are of a part of the body, its label comes first. If the scene asked for the best pressure, that pressure and its
/// method come last.
std::string methods_table(const Run& run);

/// levels_value has the sound levels at the fields of one point, one row per point and method. It also has the limits
/// that are published for the frequency, one row per limit. levels_text is both as text, empty without such fields.
Json levels_value(const Run& run);
std::string levels_text(const Run& run);

/// run_value has the name, mesh and array sizes, solutions and provenance of a run, method_values its methods with
/// every metric. describe_run is the former with methods_table, as text for a person.
Json run_value(const Run& run);
Json method_values(const Run& run);
std::string describe_run(const Run& run);

/// metrics.csv: a header line and one line per method: name, method, scheme, every metric, status. NaN is
/// written as "nan". Whole or not at all.
void write_metrics_csv(const std::string& path, const Run& run);

/// Writes text to a file, whole or not at all.
void write_text_file(const std::string& path, const std::string& text);

}  // namespace touchfield
