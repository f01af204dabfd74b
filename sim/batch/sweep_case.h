#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/batch/run_model.h"
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
  int threads = 1;   // until it is told of others
  std::string card;  // of its process, as CUDA_VISIBLE_DEVICES names it; empty: as it is
};

/// What a case is expected to take, by check_model.
struct CaseCost {
  Eigen::Index faces = 0;
  Eigen::Index channels = 0;
  double memory_mib = 0;
  double available_mib = 0;
  double seconds = 0;  // on its own
};

std::string to_json(const CaseJob& job);  // one line
/// throws   IoError on a text that is no job
CaseJob job_from_json(const std::string& text);

/// Status of an answer on a case that there was no room to write. Such an answer is not a record to be kept: the case
/// may be computed as soon as there is room.
inline constexpr const char* kNoRoom = "no room";

/// An answer of the process that computes cases. For each case it first sends the expected cost, a line
/// {"expected": {...}}. The reply to this is a line with the number of threads to continue with. Then the process sends
/// the record of the case. A case that fails early has only the record.
struct CaseAnswer {
  std::optional<CaseCost> expected;
  std::optional<SweepRecord> record;
};
std::string to_json(const CaseCost& cost);  // that first line, without its end
/// throws   IoError on a line that is neither
CaseAnswer answer_from_json(const std::string& line);

/// The loop of a worker process. It reads one job per line from standard input, computes it into its scratch folder,
/// and answers it. It ends with the input. A case that fails has a record that says why, and a failed.json beside the
/// finished results.
int serve_cases();

/// For every scene the number of its group, from 0. Scenes of a group have the same bodies, medium, scheme and solver.
/// They can share models. A scene's only body may stand elsewhere than in the other scenes of the group.
std::vector<int> body_groups(const std::vector<Scene>& scenes);

}  // namespace touchfield
