#include "sim/run/solve_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include <fmt/format.h>
#include <omp.h>

#include "sim/core/program_start.h"
#include "sim/core/text.h"
#include "sim/core/version.h"
#include "sim/gpu/gpu_library.h"
#include "sim/model/evaluation.h"
#include "sim/model/stages.h"
#include "sim/run/estimates.h"
#include "sim/run/evaluate_methods.h"
#include "sim/run/methods.h"
#include "sim/run/result_warnings.h"
#include "sim/scene/scene_reader.h"
#include "solvers/linear/instruction_level.h"
#include "solvers/phase/optimality_bound.h"
#include "solvers/phase/radiation_bound.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

namespace {

constexpr double kSmallestReciprocalCondition = 1e-8;

Run begin_run(const Model& model, const SolveOptions& options) {
  const Scene& scene = model.fixed->scene;
  const std::string text = resolved_yaml(scene);
  Provenance provenance = provenance_now(options.threads, used_seeds(scene), options.command_line, text_hash(text));
  const Evaluation& evaluation = model.fixed->evaluation;
  Run run{.name = scene.name,
          .scene = text,
          .mesh = model.body.mesh,
          .array = model.fixed->array,
          .array_truth = evaluation.other_channels ? std::optional(evaluation.channels) : std::nullopt,
          .frequency = model.fixed->wave.frequency(),
          .radiation_per_square = radiation_per_square(model.fixed->wave.medium()),
          .evaluation = to_string(evaluation.elsewhere() ? Evaluation::Kind::kNone : evaluation.kind),
          .solved_skin = model.fixed->solved_skin(),
          .provenance = std::move(provenance)};
  if (!scene.bodies.front().name.empty()) {
    for (const BodySpec& body : scene.bodies) {
      run.bodies.push_back(body.name);
    }
    run.owner = model.fixed->owner;
  }
  if (scene.target) {
    run.target = build_target(model);
  }
  return run;
}

void say(const Remarks& remarks, Run& run, Progress& progress) {
  for (const std::string& warning : remarks.warnings) {
    run.warnings.push_back(warning);
    progress.warn(warning);
  }
  for (const std::string& note : remarks.notes) {
    run.notes.push_back(note);
    progress.remark(note);
  }
}

/// The models that a scene's methods work on, one a scheme, made when first asked for.
class Models {
 public:
  Models(const Model& model, const SolveOptions& options, Run& run, Progress& progress)
      : model_(model), options_(options), run_(run), progress_(progress) {}

  MethodSolver& of(Scheme scheme) {
    auto& entry = entries_[scheme];
    if (!entry) {
      entry = std::make_unique<Entry>(make(scheme), run_.target, model_, grams_);
    }
    return entry->methods;
  }

 private:
  struct Entry {
    Entry(std::unique_ptr<SkinScattering> made, const std::optional<Target>& target, const Model& model,
          const std::shared_ptr<IncidentGrams>& grams)
        : scattering(std::move(made)),
          methods(*scattering, model.fixed->array.size(), target, model.fixed->scene.solve, outside_skin(model),
                  grams) {}
    std::unique_ptr<SkinScattering> scattering;
    MethodSolver methods;
  };

  const SolveSpec& solve() const { return model_.fixed->scene.solve; }

  std::unique_ptr<SkinScattering> make(Scheme scheme) {
    const std::string name = to_string(scheme);
    auto made =
        timed(progress_, run_.seconds, "set_up_" + name,
              fmt::format("set up scheme {} on {} faces", name, run_.mesh.face_count()), [&] {
                return make_scattering("solve " + name, run_.mesh, scheme, solve().solver,
                                       largest_block(model_.fixed->scene, scheme, model_.fixed->array.size(),
                                                     options_.models != nullptr && options_.models->shared()),
                                       model_, model_.fixed->array.response, options_.models, run_.solves, progress_);
              });
    progress_.detail(describe_decision(*made));
    return made;
  }

  const Model& model_;
  const SolveOptions& options_;
  Run& run_;
  Progress& progress_;
  std::shared_ptr<IncidentGrams> grams_ = std::make_shared<IncidentGrams>();  // no scheme changes them
  std::map<Scheme, std::unique_ptr<Entry>> entries_;
};

/// The bound that `prove` finds; 0 and a warning where it fails, as what is finished stays.
///
/// of   whose cost it is: "" of surface, or "_" and a method's name
template <class Prove>
OptimalityBound bound_of(const std::string& of, const char* cost, const Prove& prove, Run& run, Progress& progress) {
  const auto try_to = [&] {
    try {
      return prove();
    } catch (const std::exception& error) {
      say({{fmt::format("optimality_bound: no bound was found: {}", error.what())}, {}}, run, progress);
      return OptimalityBound{};
    }
  };
  const OptimalityBound found =
      timed(progress, run.seconds, "optimality_bound" + of, fmt::format("lower bound of the {}", cost), try_to);
  progress.detail(fmt::format("    bound {:.6g} after {} iterations{}", found.bound, found.iterations,
                              found.converged ? "" : ", not as tight as it could be"));
  return found;
}

/// Scores every method on surface's cost and holds it against the least that any phases can reach.
void bound_methods(const Model& model, Models& models, Run& run, Progress& progress) {
  const Scheme scheme = model.fixed->scene.solve.scheme;
  const SkinProblem& problem = models.of(scheme).skin_problem(run.target->amplitudes, progress);
  const OptimalityBound optimality_bound = bound_of(
      "", "cost on the skin [Pa2 m2]", [&] { return prove_bound(problem); }, run, progress);
  if (!model.beyond.empty()) {
    say({{},
         {"optimality_bound: its bound holds for a cost that includes the skin beyond keep_within_mm only by its "
          "incident "
          "pressure. It does not prove anything for the whole body; without keep_within_mm it does"}},
        run, progress);
  }
  const double silent = skin_cost(problem, Eigen::VectorXcd::Zero(model.fixed->array.size()));
  for (MethodResult& method : run.methods) {
    const Eigen::VectorXcd q = drive(method.solution);
    const double reached = skin_cost(problem, best_level(problem, q) * q);
    method.metrics.cost_skin = reached;
    method.metrics.cost_bound = optimality_bound.bound;
    method.metrics.error_bound = std::sqrt(optimality_bound.bound / silent);
    method.metrics.optimality_gap = optimality_gap(optimality_bound, reached, silent);
  }
}

/// Holds every method radiation against the least that its own cost can be.
void bound_radiation(const std::vector<MethodSpec>& methods, Models& models, Run& run, Progress& progress) {
  for (std::size_t i = 0; i < methods.size(); ++i) {
    if (!methods[i].kind->radiation) {
      continue;
    }
    const RadiationProblem problem =
        models.of(methods[i].scheme).radiation_problem(methods[i], run.target->amplitudes, progress);
    const Eigen::VectorXcd q = drive(run.methods[i].solution);
    const OptimalityBound found = bound_of(
        "_" + methods[i].name, "cost of radiation pressure", [&] { return prove_radiation_bound(problem, q); }, run,
        progress);
    Metrics& metrics = run.methods[i].metrics;
    metrics.cost_radiation = radiation_cost(problem, best_level(problem, q) * q);
    metrics.cost_radiation_bound = found.bound;
    metrics.optimality_gap_radiation = optimality_gap(found, metrics.cost_radiation, silent_cost(problem.skin));
  }
}

/// Keeps what the methods on the skin worked on, by each of their schemes, and by the scene's own in any case.
void keep_transfers(const SolveSpec& solve, Models& models, Run& run, Progress& progress) {
  std::set<Scheme> schemes = {solve.scheme};
  for (const MethodSpec& method : solve.methods) {
    if (method.kind->model == MethodModel::kSkin) {
      schemes.insert(method.scheme);
    }
  }
  for (const Scheme scheme : schemes) {
    MethodSolver& solver = models.of(scheme);
    const std::string name = to_string(scheme);
    run.transfers.push_back(timed(progress, run.seconds, "transfer_" + name, "transfer matrix of " + name,
                                  [&] { return solver.run_transfer(run.target->amplitudes, progress); }));
  }
}

MethodResult solve_method(const MethodSpec& method, Models& models, const Model& model, const SurfaceGradient& gradient,
                          Run& run, Progress& progress) {
  const Scene& scene = model.fixed->scene;
  const Eigen::VectorXd amplitudes = run.target ? run.target->amplitudes : Eigen::VectorXd();
  MethodSolver& solver = models.of(method.scheme);
  MethodResult result;
  result.name = method.name;
  result.method = method.kind->name;
  result.scheme = scheme_of(method);
  result.solution = timed(progress, result.seconds, "solve", fmt::format("solve {}", method.name),
                          [&] { return solver.solve(method, amplitudes, progress); });
  progress.detail(fmt::format("    {} steps, {}", result.solution.iterations, to_string(result.solution.status)));
  const Eigen::MatrixXcd drives = drive(result.solution);
  result.pressure = timed(progress, result.seconds, "pressure", fmt::format("scattered pressure of {}", method.name),
                          [&] { return solver.scattering().pressure(drives, "pressure of " + method.name); });
  note_solve(run, progress);
  require_finite("method " + method.name, result.pressure);
  if (model.fixed->evaluation.kind == Evaluation::Kind::kSame && method.scheme != scene.solve.scheme) {
    SkinScattering& own = models.of(scene.solve.scheme).scattering();
    result.evaluation_pressure = timed(progress, result.seconds, "evaluation", fmt::format("evaluate {}", method.name),
                                       [&] { return own.pressure(drives, "evaluation of " + method.name); });
    note_solve(run, progress);
    require_finite("evaluation of " + method.name, result.evaluation_pressure);
  }
  const bool elsewhere = result.evaluation_pressure.size() > 0;
  evaluate_method(result, run.mesh, gradient, model, run.target,
                  elsewhere ? result.evaluation_pressure : result.pressure);
  if (elsewhere) {
    result.metrics.evaluation_difference =
        relative_difference(run.mesh.areas(), result.pressure, result.evaluation_pressure);
  }
  return result;
}

/// Whether a scheme's first phases need no solution of its equations: its methods are then not the first to solve them.
bool begins_unsolved(const SolveSpec& solve, Scheme scheme) {
  const auto first = std::ranges::find_if(solve.methods, [&](const MethodSpec& method) {
    return method.scheme == scheme && method.kind->model != MethodModel::kGiven;
  });
  return first != solve.methods.end() &&
         (first->kind->model == MethodModel::kFree || first->kind->model == MethodModel::kScattered);
}

/// Before any phases: a matrix is factorised and its condition estimated; without a factorisation a focus is solved.
void require_sound_system(const Model& model, Scheme scheme, SkinScattering& scattering, Run& run, Progress& progress) {
  const std::string name = to_string(scheme);
  const double reciprocal = timed(progress, run.seconds, "condition_" + name, "examine the equations of " + name, [&] {
    scattering.prepare();
    const bool factorised = scattering.decision().options.kind == SolverKind::kLu && scattering.gpu() == nullptr;
    if (!factorised && begins_unsolved(model.fixed->scene.solve, scheme)) {
      scattering.pressure(free_focus(model), "trial");
      note_solve(run, progress);
    }
    return scattering.reciprocal_condition();
  });
  if (reciprocal < kSmallestReciprocalCondition) {
    say({{fmt::format("ill_conditioned: the matrix of {} has a condition number of about {:.1e}; the pressure may have "
                      "fewer than eight correct digits",
                      name, 1.0 / reciprocal)},
         {}},
        run, progress);
  }
}

/// The resonance check of the first method's scheme, and that of every other scheme without a cure on the first method
/// by it. A Burton-Miller scheme that the run has solved anyway is what they are compared with.
void check_resonances(const SolveSpec& solve, Models& models, Run& run, Progress& progress) {
  const auto cured =
      std::ranges::find_if(solve.methods, [](const MethodSpec& method) { return traits(method.scheme).burton_miller; });
  std::set<Scheme> seen;
  for (std::size_t m = 0; m < solve.methods.size(); ++m) {
    const Scheme scheme = solve.methods[m].scheme;
    if (!seen.insert(scheme).second || (m > 0 && has_cure(scheme))) {
      continue;
    }
    double spent = 0.0;
    for (const SolveRecord& record : run.solves) {
      spent += record.seconds;
    }
    const std::string name = to_string(scheme);
    const double resonance_check = timed(
        progress, run.seconds, m == 0 ? "resonance_check" : "resonance_check_" + name,
        "compare conventional and Burton-Miller pressures", [&] {
          SkinScattering* reference = cured != solve.methods.end() ? &models.of(cured->scheme).scattering() : nullptr;
          return resonance_difference(models.of(scheme).scattering(), reference, solve.solver,
                                      drive(run.methods[m].solution), run.methods[m].pressure, spent, run.solves,
                                      progress);
        });
    if (m == 0) {
      run.resonance_check = resonance_check;
    }
    if (!has_cure(scheme) && !std::isnan(resonance_check)) {
      run.resonance_checks.emplace_back(name, resonance_check);
    }
  }
}

FieldResult evaluate_grid(const FieldGrid& grid, const Model& model, const Run& run, Gpu* gpu, Progress& progress) {
  FieldValues values;
  try {
    values = run_field(run, model.fixed->wave, grid.points(), gpu);
  } catch (const GpuMemoryFailure& failure) {
    progress.warn(fmt::format("field {}: {}; the processor continues", grid.name, failure.what()));
    values = run_field(run, model.fixed->wave, grid.points());
  }
  FieldResult field{grid, std::move(values.inside), {}};
  for (std::size_t s = 0; s < run.methods.size(); ++s) {
    field.pressure.emplace_back(run.methods[s].name, values.pressure.col(static_cast<Eigen::Index>(s)));
  }
  return field;
}

}  // namespace

std::string used_seeds(const Scene& scene) {
  std::string seeds = scene.sensing ? fmt::format("sensing={}", scene.sensing->seed) : "";
  if (scene.array.tolerances) {
    seeds += fmt::format("{}tolerances={}", seeds.empty() ? "" : " ", scene.array.tolerances->seed);
  }
  if (scene.motion) {
    const MotionSpec::Sensor& sensor = scene.motion->sensor;
    const auto* noise = std::get_if<SensingNoise>(&sensor.sight);
    if (noise != nullptr || std::holds_alternative<std::vector<CameraSpec>>(sensor.sight)) {
      seeds += fmt::format("{}sensor={}", seeds.empty() ? "" : " ", noise != nullptr ? noise->seed : sensor.seed);
    }
  }
  for (const MethodSpec& method : scene.solve.methods) {
    if (method.start.kind == StartSpec::Kind::kRandom) {
      seeds += fmt::format("{}{}={}", seeds.empty() ? "" : " ", method.name, method.start.seed);
    }
  }
  return seeds;
}

std::string scheme_of(const MethodSpec& method) {
  const bool none = method.kind->model == MethodModel::kFree || method.kind->model == MethodModel::kGiven;
  return none ? "none" : to_string(method.scheme);
}

std::string used_card(const std::vector<SolveRecord>& solves) {
  const auto used =
      std::ranges::find_if(solves, [](const SolveRecord& record) { return record.device.starts_with("cuda"); });
  if (used == solves.end()) {
    return {};
  }
  const GpuInfo info = shared_gpu(std::stoi(used->device.substr(5)))->info();
  return fmt::format("{} ({}), driver for CUDA {}, CUDA {}", info.name, used->device, info.driver, info.toolkit);
}

Provenance provenance_now(int threads, const std::string& seeds, const std::string& command_line,
                          const std::string& scene_hash) {
  const BuildInfo build = build_info();
  return {.version = build.version,
          .revision = build.revision,
          .compiler = build.compiler,
          .flags = build.flags,
          .machine = machine_description(),
          .blas_core = blas_core(),
          .instruction_level = to_string(instruction_level()),
          .card = "",
          .threads = threads,
          .seeds = seeds,
          .command_line = command_line,
          .start = utc_now(),
          .end = "",
          .scene_hash = scene_hash};
}

Run solve_model(const Model& model, const SolveOptions& options, const std::function<void(const Run&)>& finished,
                Progress& progress) {
  const SolveSpec& spec = model.fixed->scene.solve;
  require_fitting_phases(model);
  Run run = begin_run(model, options);
  for (const std::string& slow : {blas_warning(), binding_warning(options.threads)}) {
    if (!slow.empty()) {
      progress.warn(slow);  // of this process, not of the result
    }
  }
  say(model_remarks(model), run, progress);
  Models models(model, options, run, progress);
  const MethodSpec& first = spec.methods.front();
  std::set<Scheme> examined;
  for (const MethodSpec& method : spec.methods) {
    if (examined.insert(method.scheme).second) {
      require_sound_system(model, method.scheme, models.of(method.scheme).scattering(), run, progress);
    }
  }
  if (run.target && !model.posture.target->pressure) {
    const auto find_scale = [&] { return models.of(first.scheme).best_scale(first, run.mesh, model.boxes, progress); };
    run.target->amplitudes *= timed(progress, run.seconds, kScaleStage,
                                    fmt::format("find the best target pressure for {}", first.name), find_scale);
  }
  const SurfaceGradient gradient(run.mesh, model.fixed->wave.k());
  for (const MethodSpec& method : spec.methods) {
    run.methods.push_back(solve_method(method, models, model, gradient, run, progress));
    finished(run);
  }
  check_resonances(spec, models, run, progress);
  if (model.fixed->evaluation.elsewhere()) {
    evaluate_elsewhere(
        model, options, [&]() -> SkinScattering& { return models.of(spec.scheme).scattering(); }, run, progress);
  }
  if (model.fixed->scene.write.transfer) {
    keep_transfers(spec, models, run, progress);
  }
  if (spec.optimality_bound && run.target) {
    bound_methods(model, models, run, progress);
    bound_radiation(spec.methods, models, run, progress);
  }
  say(result_remarks(run, methods_below_wanted(run).empty() ? kNotComputed : models.of(first.scheme).most_pressure()),
      run, progress);
  Gpu* const gpu = models.of(first.scheme).scattering().gpu();
  for (const FieldGrid& grid : model.fixed->fields) {
    run.fields.push_back(timed(progress, run.seconds, "field_" + grid.name,
                               fmt::format("field {}: {}", grid.name, counted(grid.size(), "point", "points")),
                               [&] { return evaluate_grid(grid, model, run, gpu, progress); }));
    if (grid.size() == 1 && run.fields.back().inside.front() != 0) {
      say({{fmt::format("point_inside: field {}: the point is inside the evaluation mesh, where there is no sound; "
                        "move at_mm off the skin",
                        grid.name)},
           {}},
          run, progress);
    }
  }
  run.complete = true;
  run.provenance.card = used_card(run.solves);
  run.provenance.end = utc_now();
  return run;
}

Run solve_model(const Model& model) {
  SolveOptions options;
  options.threads = omp_get_max_threads();
  const auto nobody = [](const Run&) {};
  Progress silent;
  return solve_model(model, options, nobody, silent);
}

}  // namespace touchfield
