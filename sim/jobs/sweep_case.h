#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/jobs/run_model.h"
#include "sim/run/sweep_files.h"

namespace touchfield {

/// What the process that computes a case is told.
struct CaseJob {
  int number = 0;
  std::string scene;                                        // its resolved text
  std::vector<std::pair<std::string, std::string>> inputs;  // what it changes, for the record
  int scenes = 1;                                           // how many cases of the sweep share its body
  std::string command_line;
  int threads = 1;
  std::string card;  // of its process, as CUDA_VISIBLE_DEVICES names it; empty: as it is
};

/// A job as a file of the folder that the case is computed in.
/// throws   IoError
void write_job(const CaseJob& job, const std::string& scratch);
CaseJob read_job(const std::string& scratch);

/// What a process answers when the record of a case stands in its folder. Any other answer is why no case can be
/// computed, such as a full disk: it is no result of this one.
inline constexpr const char* kCaseDone = "done";

/// The loop of a worker process. It reads the path of one folder per line from standard input, computes the job there,
/// and answers. It ends with the input. A case that fails has a record that says why, and a failed.json beside the
/// finished results.
int serve_cases();

/// For every scene the number of its group, from 0. Scenes of a group have the same bodies, medium, scheme and solver.
/// They can share models. A scene's only body may stand elsewhere than in the other scenes of the group.
std::vector<int> body_groups(const std::vector<Scene>& scenes);

}  // namespace touchfield
