#include "sim/jobs/sweep_case.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <new>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/json.h"
#include "sim/core/program_start.h"
#include "sim/core/version.h"
#include "sim/jobs/play_scene.h"
#include "sim/jobs/sweep_directory.h"
#include "sim/motion/frame_solver.h"
#include "sim/run/check.h"
#include "sim/run/motion_summary.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

constexpr const char* kJobFile = "/.job.json";
constexpr std::size_t kMostJobBytes = std::size_t{1} << 28U;

void take_results(const Run& run, SweepRecord& record) {
  record.faces = static_cast<int>(run.mesh.face_count());
  record.channels = static_cast<int>(run.array.size());
  record.warnings = run.warnings;
  for (const MethodResult& method : run.methods) {
    record.methods.push_back(
        {method.name, method.method, method.scheme, to_string(method.solution.status), method.metrics});
  }
}

void take_results(const Motion& motion, SweepRecord& record) {
  record.faces = static_cast<int>(motion.mesh.face_count());
  record.channels = static_cast<int>(motion.array.size());
  record.warnings = motion.warnings;
  for (const MotionMethod& method : motion.methods) {
    const MotionSummary over = summary(method);
    SweepRecord::Method row{method.name, method.method, method.scheme, "played", {}, summary_columns(over)};
    for (std::size_t i = 0; i < metric_fields().size(); ++i) {
      row.metrics.*metric_fields()[i].value = over.metrics[i].median;
    }
    record.methods.push_back(std::move(row));
  }
}

/// What one case of a sweep leaves to the next.
struct KeptWork {
  KeptBodies bodies;
  KeptModels models{&bodies};
};

void compute(const CaseJob& job, const std::string& scratch, KeptWork& kept, SweepRecord& record) {
  Progress progress;
  const Scene scene = read_scene_text(job.scene, fmt::format("case {}", job.number), "");
  RunDirectory directory = RunDirectory::made(scratch);
  if (scene.motion) {
    require_motion_memory(scene);
    MotionOptions options{.command_line = job.command_line, .threads = job.threads};
    const SensedMotion sensed = sensed_motion(within_budget(scene, options.notes), &kept.bodies);
    require_memory(check_model(sensed.solved().first()));
    take_results(filled(directory, progress, play_job(sensed, options).compute), record);
    return;
  }
  const Model model = build_model(scene, &kept.bodies);
  require_memory(check_model(model, job.scenes));
  const SolveOptions options{job.command_line, job.threads, &kept.bodies, &kept.models};
  take_results(filled(directory, progress, run_job(model, options).compute), record);
  std::filesystem::remove(directory.file("metrics.csv"));  // the record has them
}

/// throws   NoRoomError alone
SweepRecord run_case(const CaseJob& job, const std::string& scratch, KeptWork& kept) {
  SweepRecord record;
  record.number = job.number;
  record.inputs = job.inputs;
  record.revision = build_info().revision;
  record.status = "failed";
  const auto start = std::chrono::steady_clock::now();
  kept.models.expect(job.scenes);
  try {
    compute(job, scratch, kept, record);
    record.status = "ok";
  } catch (const NoRoomError&) {
    throw;
  } catch (const std::bad_alloc&) {
    record.reason = out_of_memory() + "; a larger body.edge_mm needs less";
  } catch (const std::exception& error) {
    record.reason = error.what();
  }
  record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return record;
}

/// What scenes that may share their models have in common, as text.
std::string sharing_key(const Scene& scene) {
  Scene shared = scene;
  shared.name.clear();
  shared.array = {};
  shared.fields.clear();
  shared.write = {};
  shared.felt.reset();
  if (shared.bodies.size() == 1) {
    shared.bodies.front().place.at.setZero();
    shared.bodies.front().place.angles.setZero();
  }
  if (shared.target) {
    shared.target->pressure.reset();
    shared.target->quantity = TargetQuantity::kPressure;
    shared.target->profile = TargetProfile::kUniform;
    const EdgeSpec* edge = shared.bodies.front().edge ? &*shared.bodies.front().edge : nullptr;
    const bool shapes_mesh =
        (edge != nullptr && edge->near_target) || shared.bodies.front().keep_within ||
        (scene.evaluation.kind == EvaluationSpec::Kind::kEdge && scene.evaluation.edge.near_target);
    if (!shapes_mesh) {
      shared.target.reset();
    } else {
      for (TargetBoxSpec& box : shared.target->boxes) {
        box.size.setOnes();
        box.angles.setZero();
        box.level = 1.0;
      }
      for (TargetPointSpec& point : shared.target->points) {
        point.diameter = point.level = 1.0;
      }
      for (TargetLineSpec& line : shared.target->lines) {
        line.level = 1.0;
      }
    }
  }
  SolveSpec solve;
  solve.scheme = scene.solve.scheme;
  solve.solver = scene.solve.solver;
  shared.solve = solve;
  return resolved_yaml(shared);
}

}  // namespace

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CaseJob, number, scene, inputs, scenes, command_line, threads, card)

void write_job(const CaseJob& job, const std::string& scratch) {
  write_atomically(scratch + kJobFile, {json_text(nlohmann::json(job))});
}

CaseJob read_job(const std::string& scratch) {
  try {
    return json_from_text<nlohmann::json>(read_whole_file(scratch + kJobFile, kMostJobBytes)).get<CaseJob>();
  } catch (const nlohmann::json::exception& error) {
    throw IoError(fmt::format("{}{}: {}", scratch, kJobFile, error.what()));
  }
}

int serve_cases() {
  // Whatever a library prints must not end up among the answers.
  FILE* answers = fdopen(dup(STDOUT_FILENO), "w");
  dup2(STDERR_FILENO, STDOUT_FILENO);
  if (answers == nullptr) {
    throw IoError("the answers cannot be written");
  }
  std::ofstream("/proc/self/oom_score_adj") << 500;  // where memory is short, a case goes rather than the sweep
  KeptWork kept;
  std::string scratch;
  while (std::getline(std::cin, scratch)) {
    std::string answer = kCaseDone;
    try {
      const CaseJob job = read_job(scratch);
      if (!job.card.empty()) {  // before the first one is looked for; always the same
        setenv("CUDA_VISIBLE_DEVICES", job.card.c_str(), 1);
      }
      omp_set_num_threads(job.threads);
      take_blas_buffers(job.threads);
      write_record(run_case(job, scratch, kept), scratch);
    } catch (const Error& error) {
      answer = error.what();
      std::ranges::replace(answer, '\n', ' ');
    }
    fmt::print(answers, "{}\n", answer);
    std::fflush(answers);
  }
  std::fclose(answers);
  return 0;
}

std::vector<int> body_groups(const std::vector<Scene>& scenes) {
  std::map<std::string, int> numbers;
  std::vector<int> groups;
  groups.reserve(scenes.size());
  for (const Scene& scene : scenes) {
    groups.push_back(numbers.emplace(sharing_key(scene), static_cast<int>(numbers.size())).first->second);
  }
  return groups;
}

}  // namespace touchfield
