#pragma once

#include <map>
#include <string>
#include <vector>

#include "sim/batch/sweep_directory.h"

namespace touchfield {

/// What the summary of a sweep says of its plan; records are not there yet.
SweepSummary summary_of(const SweepIdentity& identity);

/// Records in the order of their numbers.
std::vector<SweepRecord> listed(const std::map<int, SweepRecord>& records);

/// What lies in a directory, or in all its shards merged into it.
struct SweepCollection {
  SweepSummary summary;
  std::vector<std::string> gaps;  // a line each: shards that are missing, cases that are missing or damaged
};

/// throws   InputError if there is no sweep, or shards of different plans
SweepCollection collect_sweep(const std::string& directory);

}  // namespace touchfield
