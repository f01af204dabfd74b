#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/commands/command_line.h"
#include "sim/assess/study.h"
#include "sim/body/hand.h"
#include "sim/mesh/repair/repair.h"

namespace touchfield {

struct RunCommand {
  std::string scene;
  std::string from;                    // run.h5 whose scene is run again instead
  std::string output;                  // empty: results/runs/NAME-NNNN
  std::vector<std::string> overrides;  // key.path=value
  bool force = false;
  std::string command_line;
};

struct CheckCommand {
  std::string scene;
  std::vector<std::string> overrides;
  bool resolved = false;
  bool accuracy = false;  // measure the discretisation error on this mesh
};

struct StudyCommand {
  std::string scene;
  std::string output;  // empty: results/runs/NAME_study-NNNN
  std::vector<std::string> overrides;
  bool force = false;
  StudyOptions options;
  std::optional<double> budget;  // [s]
  std::optional<double> error;   // [%]
};

struct SweepCommand {
  std::string sweep;
  std::string output;                  // empty: results/runs/NAME_sweep-NNNN
  std::vector<std::string> overrides;  // of every case
  std::string collect;                 // directory to collect instead; then `sweep` is empty
  std::string shard = "1/1";
  std::string metric = "relative_error";  // of the plot
  int jobs = 0;
  double case_seconds = 0.0;  // 0: derived
  bool resume = false;
  bool retry_failed = false;
  std::string command_line;
};

struct HandCommand {
  std::string output;
  bool force = false;  // replace an existing file
  HandOptions options;
  double unit = 1e-3;  // metres per file unit
};

struct MeshCommand {
  std::string file;
  std::string output;       // empty: report only
  bool force = false;       // replace an existing file
  std::string unit;         // of the file: mm, cm or m; empty: guessed
  std::string output_unit;  // empty: the file's
  bool repair = false;
  RepairOptions repair_options;
  std::optional<std::string> cut;  // see parse_cut_plane; in the file's unit
  std::optional<double> edge;      // to remesh to [m]
};

/// Each command prints its results on standard output and returns the exit code; errors are thrown.
int run_command(const RunCommand& command, const CommonFlags& flags);
int check_command(const CheckCommand& command, const CommonFlags& flags);
int study_command(const StudyCommand& command, const CommonFlags& flags);
int sweep_command(const SweepCommand& command, const CommonFlags& flags);
/// The process that computes cases of a sweep: see serve_cases.
int sweep_worker_command();
/// What would make runs slow or incomplete on this machine.
int doctor_command(const CommonFlags& flags);
int info_command(const std::string& path, const CommonFlags& flags);
int hand_command(const HandCommand& command, const CommonFlags& flags);
int mesh_command(const MeshCommand& command, const CommonFlags& flags);
int schema_command(const std::string& format);

}  // namespace touchfield
