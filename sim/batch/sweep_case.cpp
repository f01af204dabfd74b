#include "sim/batch/sweep_case.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <new>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>

#include "sim/assess/check.h"
#include "sim/assess/peak_memory.h"
#include "sim/batch/play_scene.h"
#include "sim/batch/run_directory.h"
#include "sim/core/atomic_file.h"
#include "sim/core/errors.h"
#include "sim/core/json_text.h"
#include "sim/core/text_number.h"
#include "sim/core/version.h"
#include "sim/motion/frame_budget.h"
#include "sim/motion/sensed_motion.h"
#include "sim/scene/scene_reader.h"
#include "sim/store/motion_summary.h"
#include "solvers/linear/system_limits.h"

namespace touchfield {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kExpected = "expected";

void take_results(const Run& run, SweepRecord& record) {
  record.faces = static_cast<int>(run.mesh.face_count());
  record.channels = static_cast<int>(run.array.size());
  record.judged_skin = to_string(run.judged_skin);
  record.warnings = run.warnings;
  for (const MethodResult& method : run.methods) {
    record.methods.push_back(
        {method.name, method.method, method.scheme, to_string(method.solution.status), method.metrics});
  }
}

void take_results(const Motion& motion, SweepRecord& record) {
  record.faces = static_cast<int>(motion.mesh.face_count());
  record.channels = static_cast<int>(motion.array.size());
  record.judged_skin = to_string(motion.judged_skin);
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

/// Calls work(directory), and closes that with the reason if it fails.
template <typename Work>
void in_directory(const std::string& path, const Work& work) {
  RunDirectory directory = RunDirectory::made(path);
  try {
    work(directory);
  } catch (const std::exception& error) {
    directory.fail(error.what());
    throw;
  }
}

CaseCost cost_of(const CheckReport& report, double seconds) {
  return {report.faces, report.channels, report.memory_mib, report.available_mib, seconds};
}

/// What one case of a sweep leaves to the next.
struct KeptWork {
  KeptBodies bodies;
  KeptModels models{&bodies};
};

/// Called with what a case is expected to take; returns the number of threads it goes on with.
using Expect = std::function<int(const CaseCost&)>;

void compute(const CaseJob& job, KeptWork& kept, const Expect& expect, SweepRecord& record) {
  Progress progress;
  const Scene scene = read_scene_text(job.scene, fmt::format("case {}", job.number), "");
  if (scene.motion) {
    require_motion_memory(scene);
    MotionOptions options{.command_line = job.command_line};
    const SensedMotion sensed = sensed_motion(within_budget(scene, options.notes), &kept.bodies);
    const CheckReport report = check_model(sensed.solved().first());
    require_memory(report);
    options.threads = expect(cost_of(report, expected_cost(sensed).seconds));
    in_directory(job.scratch, [&](RunDirectory& directory) {
      take_results(play_scene(sensed, options, directory, progress), record);
    });
    return;
  }
  const Model model = build_model(scene, &kept.bodies);
  const CheckReport report = check_model(model, job.scenes);
  require_memory(report);
  const int threads = expect(cost_of(report, report.seconds));
  in_directory(job.scratch, [&](RunDirectory& directory) {
    SolveOptions options{job.command_line, threads, &kept.bodies, &kept.models};
    take_results(run_model(model, options, directory, progress), record);
    std::filesystem::remove(directory.file("metrics.csv"));  // the record has them
  });
}

/// Nothing is thrown.
SweepRecord run_case(const CaseJob& job, KeptWork& kept, const Expect& expect) {
  SweepRecord record;
  record.number = job.number;
  record.inputs = job.inputs;
  record.revision = build_info().revision;
  const auto start = std::chrono::steady_clock::now();
  reset_peak_memory();
  kept.models.take_count();
  kept.models.expect(job.scenes);
  try {
    compute(job, kept, expect, record);
    record.status = "ok";
  } catch (const NoRoomError& error) {
    record.status = kNoRoom;
    record.reason = error.what();
  } catch (const std::bad_alloc&) {
    record.reason = out_of_memory() + "; a larger body.edge_mm needs less";
  } catch (const std::exception& error) {
    record.reason = error.what();
  }
  if (record.status.empty()) {
    record.status = "failed";
  }
  const KeptModels::Count count = kept.models.take_count();
  record.models = count.asked;
  record.models_reused = count.reused;
  record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  record.peak_mib = peak_memory_mib();
  return record;
}

/// What scenes that may share their models have in common, as text.
std::string sharing_key(const Scene& scene) {
  Scene shared = scene;
  shared.name.clear();
  shared.array = {};
  shared.fields.clear();
  shared.write = {};
  if (shared.bodies.size() == 1) {
    shared.bodies.front().place.at.setZero();
    shared.bodies.front().place.angles.setZero();
  }
  if (shared.target) {
    shared.target->pressure.reset();
    shared.target->profile = TargetProfile::kUniform;
    const EdgeSpec* edge = shared.bodies.front().edge ? &*shared.bodies.front().edge : nullptr;
    const bool shapes_mesh = (edge != nullptr && edge->near_target) || shared.bodies.front().keep_within ||
                             (scene.judge.kind == JudgeSpec::Kind::kEdge && scene.judge.edge.near_target);
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

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CaseJob, number, scratch, scene, inputs, scenes, command_line, threads, card)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CaseCost, faces, channels, memory_mib, available_mib, seconds)

std::string to_json(const CaseJob& job) { return json_text(nlohmann::json(job)); }

CaseJob job_from_json(const std::string& text) {
  try {
    return json_from_text<nlohmann::json>(text).get<CaseJob>();
  } catch (const Json::exception& error) {
    throw IoError(fmt::format("a case's job cannot be read: {}", error.what()));
  }
}

std::string to_json(const CaseCost& cost) { return nlohmann::json{{kExpected, cost}}.dump(); }

CaseAnswer answer_from_json(const std::string& line) {
  try {
    const auto json = json_from_text<nlohmann::json>(line);
    if (json.contains(kExpected)) {
      return {json.at(kExpected).get<CaseCost>(), std::nullopt};
    }
  } catch (const Json::exception& error) {
    throw IoError(fmt::format("the answer of a process that computes cases cannot be read: {}", error.what()));
  }
  return {std::nullopt, record_from_json(line, "answer of a process that computes cases")};
}

int serve_cases() {
  // Whatever a library prints must not end up among the answers.
  FILE* answers = fdopen(dup(STDOUT_FILENO), "w");
  dup2(STDERR_FILENO, STDOUT_FILENO);
  if (answers == nullptr) {
    throw IoError("the answers cannot be written");
  }
  const auto answer = [answers](const std::string& line) {
    fmt::print(answers, "{}", line);
    std::fflush(answers);
  };
  KeptWork kept;
  std::string line;
  while (std::getline(std::cin, line)) {
    const CaseJob job = job_from_json(line);
    if (!job.card.empty()) {  // before the first one is looked for; always the same
      setenv("CUDA_VISIBLE_DEVICES", job.card.c_str(), 1);
    }
    omp_set_num_threads(job.threads);
    take_blas_buffers(job.threads);
    const auto expect = [&](const CaseCost& cost) {
      answer(to_json(cost) + "\n");
      std::getline(std::cin, line);
      const int threads = number_of<int>(line).value_or(job.threads);
      omp_set_num_threads(threads);
      return threads;
    };
    answer(to_json(run_case(job, kept, expect), -1));
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
