#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/core/json.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// What a case of a sweep came to.
struct SweepRecord {
  int number = 0;
  std::vector<std::pair<std::string, std::string>> inputs;  // path -> value as YAML, what the case changes
  std::string status;                                       // ok or failed
  std::string reason;                                       // why it failed
  struct Method {
    std::string name;
    std::string method;
    std::string scheme;
    std::string status;
    Metrics metrics;                                            // of a motion their medians
    std::vector<std::pair<std::string, double>> over_motion{};  // of a motion: its summary_columns
  };
  std::vector<Method> methods;  // empty if the case failed
  int faces = 0;
  int channels = 0;
  double seconds = kNotComputed;  // of the whole case
  std::vector<std::string> warnings;
  std::string revision;  // of the program that computed it
  struct File {
    std::string name;
    std::uintmax_t bytes = 0;
    std::string crc32;  // eight hexadecimal digits
  };
  std::vector<File> files;  // of its folder, as they were when the case was finished
};

/// case.json: the record as JSON with a CRC-32 of itself; numbers that were not computed are null.
///
/// indent   -1: all in one line
std::string to_json(const SweepRecord& record, int indent = 1);
/// throws   IoError naming `path` if the text is no such record or no longer the one that was written
SweepRecord record_from_json(const std::string& text, const std::string& path);

/// A sweep as its table has it.
struct SweepSummary {
  std::string name;
  int cases = 0;                        // of the plan
  std::vector<std::string> parameters;  // paths
  std::vector<SweepRecord> records;     // what is done, by number
};

/// A line of a sweep's table, which its pictures show too.
struct SweepRow {
  const SweepRecord* record;
  const SweepRecord::Method* method;  // null: no method of the case has finished
};

/// The rows point into the summary.
std::vector<SweepRow> sweep_rows(const SweepSummary& summary);
std::vector<SweepRow> sweep_rows(const SweepSummary&&) = delete;

/// The value that a case gives a path; nothing if it leaves it alone.
std::optional<std::string> input_of(const SweepRecord& record, const std::string& path);

/// A parameter in every row as numbers, NaN where a case leaves it alone; nothing if a value is no number.
std::optional<std::vector<double>> parameter_numbers(const std::string& path, const std::vector<SweepRow>& rows);

/// The column of a parameter: its path, but scene.name for `name`, which is that of the method.
std::string column_of(const std::string& parameter);

/// The table: an object of its columns, and an array of objects like it, one per case and method. A case without a
/// finished method has one line. The columns are:
///
///   case, status
///   the parameters, as they were written (column_of)
///   name, method, scheme
///   every metric
///   of motions, the statistics over time (motion_summary.h)
///   method_status, faces, channels, seconds, revision, reason
Json sweep_columns(const SweepSummary& summary);
Json sweep_lines(const SweepSummary& summary);

/// sweep.csv: these lines. Whole or not at all.
void write_sweep_csv(const std::string& path, const SweepSummary& summary);

/// The first and last lines of the table for a person. Each line has the case, the
/// parameters that differ between cases, the method, its errors, widths, leakage and force, seconds and status.
///
/// most   lines; those in the middle are left out
std::string sweep_table(const SweepSummary& summary, std::size_t most = 40);

}  // namespace touchfield
