#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/batch/run_model.h"
#include "sim/core/progress.h"
#include "sim/store/sweep_files.h"

namespace touchfield {

/// What the process that computes a case is told.
struct CaseJob {
  int number = 0;
  std::string scratch;                                      // folder to compute it in
  std::string scene;                                        // its resolved text
  std::vector<std::pair<std::string, std::string>> inputs;  // what it changes, for the record
  int scenes = 1;                                           // how many cases of the sweep share its body
  std::string command_line;
  int threads = 1;
};

std::string to_json(const CaseJob& job);  // one line
/// throws   IoError on a text that is no job
CaseJob job_from_json(const std::string& text);

/// What one case of a sweep leaves to the next.
struct KeptWork {
  KeptBodies bodies;
  KeptModels models;
};

/// Status of an answer on a case that there was no room to write: it is no record to be kept, the case may be computed
/// as soon as there is room.
inline constexpr const char* kNoRoom = "no room";

/// Computes a case into its scratch folder and returns its record. A case that fails has a record that says why, and a
/// failed.json beside what was finished. Nothing is thrown.
///
/// expect   called with the seconds that the case is expected to take (check_model), once its model stands
SweepRecord run_case(const CaseJob& job, KeptWork& kept, Progress& progress, const std::function<void(double)>& expect);

/// What the process that computes cases says of one: first how long it is expected to take, a line
/// {"expected_seconds": 12.5}, then its record.
struct CaseAnswer {
  std::optional<double> expected_seconds;
  std::optional<SweepRecord> record;
};
/// throws   IoError on a line that is neither
CaseAnswer answer_from_json(const std::string& line);

/// The loop of a worker process: reads a job a line from standard input, computes it, and answers it; ends with the
/// input.
int serve_cases();

/// For every scene the number of its group, from 0: scenes of a group have the same bodies, medium and schemes, and
/// share models if they only stand elsewhere.
std::vector<int> body_groups(const std::vector<Scene>& scenes);

}  // namespace touchfield
