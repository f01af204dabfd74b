#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/store/sweep_files.h"

/// What the table and the pictures of a sweep share.
namespace touchfield {

/// A line of a sweep's table.
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

}  // namespace touchfield
