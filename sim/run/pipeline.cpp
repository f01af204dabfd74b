#include "sim/run/pipeline.h"

#include <algorithm>
#include <map>
#include <memory>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text_hash.h"
#include "sim/core/version.h"
#include "sim/field/evaluate.h"
#include "sim/field/judge.h"
#include "sim/output/figures.h"
#include "sim/output/run_file.h"
#include "sim/output/vtk_files.h"
#include "sim/run/alarm.h"
#include "sim/run/judging.h"
#include "sim/run/methods.h"
#include "sim/run/provenance.h"
#include "sim/run/stages.h"
#include "sim/run/warnings.h"
#include "sim/scene/scene_reader.h"
#include "solvers/linear/blas_core.h"
#include "solvers/phase/certificate.h"

namespace touchfield {

namespace {

constexpr double kSmallestReciprocalCondition = 1e-8;

std::string used_seeds(const Scene& scene) {
  std::string seeds = scene.sensing ? fmt::format("sensing={}", scene.sensing->seed) : "";
  for (const MethodSpec& method : scene.solve.methods) {
    if (method.start.kind == StartSpec::Kind::kRandom) {
      seeds += fmt::format("{}{}={}", seeds.empty() ? "" : " ", method.name, method.start.seed);
    }
  }
  return seeds;
}

/// The scheme whose matrix a method works on; the free field and given phases know none.
std::string scheme_of(const MethodSpec& method) {
  const bool none = method.kind == MethodKind::kUnscattered || method.kind == MethodKind::kFixed;
  return none ? "none" : to_string(method.scheme);
}

Run begin_run(const Scene& scene, const Model& model, const RunOptions& options) {
  const std::string text = resolved_yaml(scene);
  Provenance provenance = provenance_now(options.threads, used_seeds(scene), options.command_line, text_hash(text));
  const bool judged_by_itself = scene.judge.kind == JudgeSpec::Kind::kSame && !judged_elsewhere(scene);
  const std::string judge = judged_by_itself ? "same" : "none";
  Run run{scene.name, text, model.body.mesh, model.array, std::nullopt,          judge, std::nullopt, {}, {},
          {},         {},   kNotComputed,    {},          std::move(provenance), false, {},           {}};
  if (!scene.bodies.front().name.empty()) {
    for (const BodySpec& body : scene.bodies) {
      run.bodies.push_back(body.name);
    }
    run.owner = model.owner;
  }
  if (scene.target) {
    run.target = build_target(scene, model);
  }
  return run;
}

void write_tables(const Scene& scene, const Run& run, const RunDirectory& directory) {
  if (scene.write.h5) {
    write_run_file(directory.file("run.h5"), run);
  }
  write_metrics_csv(directory.file("metrics.csv"), run);
}

void warn(const std::vector<std::string>& warnings, Run& run, Progress& progress) {
  for (const std::string& warning : warnings) {
    run.warnings.push_back(warning);
    progress.warn(warning);
  }
}

/// A body in a scheme with the scene's array. Where models are kept it is set up in the first body's own frame, in
/// which a scene that only moves has the same mesh.
std::unique_ptr<SkinScattering> make_scattering(const std::string& role, const TriangleMesh& mesh, Scheme scheme,
                                                const SolverSpec& spec, Eigen::Index right_hand_sides,
                                                const Model& model, const RunOptions& options, Run& run,
                                                Progress& progress) {
  if (options.models == nullptr || model.array.kind != TransducerArray::Kind::kTransducers) {
    return std::make_unique<SkinScattering>(mesh, model.wave, scheme, spec, model.array, run.solves, progress,
                                            right_hand_sides);
  }
  const TriangleMesh own(model.own_frame(mesh.vertices()), mesh.triangles());
  return std::make_unique<SkinScattering>(options.models->get(role, own, model.wave, scheme, spec, right_hand_sides),
                                          moved(model.array, model.own_frame), run.solves, progress);
}

/// The models that a scene's methods work on, one a scheme, made when first asked for.
class Models {
 public:
  Models(const Scene& scene, const Model& model, const RunOptions& options, Run& run, Progress& progress)
      : scene_(scene), model_(model), options_(options), run_(run), progress_(progress) {}

  MethodSolver& of(Scheme scheme) {
    auto& entry = entries_[scheme];
    if (!entry) {
      entry = std::make_unique<Entry>(make(scheme), model_.array.size(), run_.target, scene_.solve);
    }
    return entry->methods;
  }

 private:
  struct Entry {
    Entry(std::unique_ptr<SkinScattering> made, Eigen::Index channels, const std::optional<Target>& target,
          const SolveSpec& solve)
        : scattering(std::move(made)), methods(*scattering, channels, target, solve) {}
    std::unique_ptr<SkinScattering> scattering;
    MethodSolver methods;
  };

  std::unique_ptr<SkinScattering> make(Scheme scheme) {
    const std::string name = to_string(scheme);
    auto made = timed(progress_, run_.seconds, "set_up_" + name,
                      fmt::format("set up scheme {} on {} faces", name, run_.mesh.face_count()), [&] {
                        return make_scattering("solve " + name, run_.mesh, scheme, scene_.solve.solver,
                                               largest_block(scene_.solve, scheme, model_.array.size(),
                                                             options_.models != nullptr && options_.models->shared()),
                                               model_, options_, run_, progress_);
                      });
    progress_.note(describe_decision(*made));
    return made;
  }

  const Scene& scene_;
  const Model& model_;
  const RunOptions& options_;
  Run& run_;
  Progress& progress_;
  std::map<Scheme, std::unique_ptr<Entry>> entries_;
};

void note_solve(const Run& run, Progress& progress) {
  const SolveRecord& solve = run.solves.back();
  progress.note(fmt::format("    {}: {} step{}, {} refinement{}, residual {:.1e}{}", solve.stage, solve.steps,
                            solve.steps == 1 ? "" : "s", solve.refinements, solve.refinements == 1 ? "" : "s",
                            solve.residual, solve.converged ? "" : ", NOT CONVERGED"));
}

Metrics judged(const TriangleMesh& mesh, const Model& model, const std::optional<Target>& target,
               const Eigen::VectorXcd& pressure) {
  return target ? judge(mesh, model.wave, model.boxes, *target, pressure)
                : judge_without_target(mesh, model.wave, pressure);
}

/// Scores every method on surface's cost and holds it against the least that any phases can reach.
void certify_methods(const Scene& scene, Models& models, Run& run, Progress& progress) {
  const SkinProblem& problem = models.of(scene.solve.scheme).skin_problem(run.target->amplitudes, progress);
  const auto prove = [&] {
    try {
      return certify(problem);
    } catch (const std::exception& error) {  // what is finished stays
      warn({fmt::format("certificate: no bound was found: {}", error.what())}, run, progress);
      return Certificate{};
    }
  };
  const Certificate certificate =
      timed(progress, run.seconds, "certificate", "lower bound of the cost on the skin", prove);
  progress.note(fmt::format("    bound {:.6g} Pa2 m2 after {} iterations{}", certificate.bound, certificate.iterations,
                            certificate.converged ? "" : ", not as tight as it could be"));
  for (MethodResult& method : run.methods) {
    const Eigen::VectorXcd q = drive(method.solution);
    const double reached = skin_cost(problem, best_level(problem, q) * q);
    method.metrics.cost_skin = reached;
    method.metrics.cost_bound = certificate.bound;
    method.metrics.optimality_gap = optimality_gap(problem, certificate, reached);
  }
}

/// A judge's metrics take the place of what was there; what the method itself knows stays.
void set_metrics(MethodResult& result, Metrics metrics) {
  if (!result.solution.cost_history.empty()) {
    metrics.cost = result.solution.cost_history.back();
  }
  metrics.iterations = result.solution.iterations;
  metrics.seconds_solve = result.seconds.front().second;
  metrics.seconds_total = 0.0;
  for (const auto& [stage, seconds] : result.seconds) {
    metrics.seconds_total += seconds;
  }
  result.metrics = metrics;
}

void require_finite(const std::string& what, const Eigen::MatrixXcd& pressure) {
  if (!pressure.allFinite()) {
    throw NumericalError(fmt::format("{}: the scattered pressure is not finite", what));
  }
}

MethodResult solve_method(const MethodSpec& method, const Scene& scene, Models& models, const Model& model, Run& run,
                          Progress& progress) {
  const Eigen::VectorXd amplitudes = run.target ? run.target->amplitudes : Eigen::VectorXd();
  MethodSolver& solver = models.of(method.scheme);
  MethodResult result;
  result.name = method.name;
  result.method = to_string(method.kind);
  result.scheme = scheme_of(method);
  result.solution = timed(progress, result.seconds, "solve", fmt::format("solve {}", method.name),
                          [&] { return solver.solve(method, amplitudes, progress); });
  const Eigen::MatrixXcd drives = drive(result.solution);
  result.pressure = timed(progress, result.seconds, "pressure", fmt::format("scattered pressure of {}", method.name),
                          [&] { return solver.scattering().pressure(drives, "pressure of " + method.name); });
  note_solve(run, progress);
  require_finite("method " + method.name, result.pressure);
  if (scene.judge.kind == JudgeSpec::Kind::kSame && !judged_elsewhere(scene) && method.scheme != scene.solve.scheme) {
    SkinScattering& own = models.of(scene.solve.scheme).scattering();
    result.judge_pressure = timed(progress, result.seconds, "judge", fmt::format("judge {}", method.name),
                                  [&] { return own.pressure(drives, "judge of " + method.name); });
    note_solve(run, progress);
    require_finite("judge of " + method.name, result.judge_pressure);
  }
  const bool elsewhere = result.judge_pressure.size() > 0;
  set_metrics(result, judged(run.mesh, model, run.target, elsewhere ? result.judge_pressure : result.pressure));
  if (elsewhere) {
    result.metrics.judge_difference = relative_difference(run.mesh.areas(), result.pressure, result.judge_pressure);
  }
  return result;
}

Eigen::MatrixXcd drives_of(const Run& run) {
  Eigen::MatrixXcd drives(run.array.size(), static_cast<Eigen::Index>(run.methods.size()));
  for (std::size_t s = 0; s < run.methods.size(); ++s) {
    drives.col(static_cast<Eigen::Index>(s)) = drive(run.methods[s].solution);
  }
  return drives;
}

Eigen::MatrixXcd pressures_of(const Run& run) {
  Eigen::MatrixXcd pressures(run.mesh.face_count(), static_cast<Eigen::Index>(run.methods.size()));
  for (std::size_t s = 0; s < run.methods.size(); ++s) {
    pressures.col(static_cast<Eigen::Index>(s)) = run.methods[s].pressure;
  }
  return pressures;
}

/// Every method on the judge's own mesh, all of them at once.
void judge_elsewhere(const Scene& scene, const Model& model, const RunOptions& options, Run& run, Progress& progress) {
  const JudgeMesh judge_mesh = timed(progress, run.seconds, "judge_mesh", "mesh of the judge",
                                     [&] { return build_judge_mesh(scene, model, options.bodies); });
  const TriangleMesh& mesh = judge_mesh.mesh;
  const Scheme scheme = scene.judge.kind == JudgeSpec::Kind::kSame ? scene.solve.scheme : scene.judge.scheme;
  JudgeModel judge_model{to_string(scheme), mesh, std::nullopt};
  if (scene.target) {
    judge_model.target = build_target(scene, model, mesh);
    if (!scene.target->pressure) {  // the scale that was found for the solving mesh
      judge_model.target->amplitudes *= run.target->amplitudes.maxCoeff() / judge_model.target->amplitudes.maxCoeff();
    }
  }
  SolverSpec spec = scene.solve.solver;
  spec.solver = SolverChoice::kAuto;
  spec.precision = PrecisionChoice::kAuto;
  auto scattering =
      timed(progress, run.seconds, "judge_set_up",
            fmt::format("set up the judge: {} on {} faces", judge_model.scheme, mesh.face_count()), [&] {
              return make_scattering("judge", mesh, scheme, spec, static_cast<Eigen::Index>(run.methods.size()), model,
                                     options, run, progress);
            });
  progress.note(describe_decision(*scattering));
  const Eigen::MatrixXcd pressures =
      timed(progress, run.seconds, "judge", fmt::format("judge {} methods", run.methods.size()),
            [&] { return scattering->pressure(drives_of(run), "judge"); });
  note_solve(run, progress);
  require_finite("judge", pressures);
  const Eigen::MatrixXcd own = pressures_of(run);
  const Eigen::VectorXd differences =
      JudgeComparison(run.mesh, mesh, judge_mesh.splits, model.skin).differences(own, pressures);
  Eigen::VectorXd target_differences = Eigen::VectorXd::Constant(differences.size(), kNotComputed);
  if (run.target) {
    std::vector<unsigned char> near = target_surroundings(run.mesh, run.target->faces);
    for (std::size_t f = 0; f < near.size(); ++f) {
      near[f] = near[f] != 0 && model.skin[f] != 0 ? 1 : 0;
    }
    target_differences = JudgeComparison(run.mesh, mesh, judge_mesh.splits, near).differences(own, pressures);
  }
  for (std::size_t s = 0; s < run.methods.size(); ++s) {
    const auto column = static_cast<Eigen::Index>(s);
    run.methods[s].judge_pressure = pressures.col(column);
    set_metrics(run.methods[s], judged(mesh, model, judge_model.target, pressures.col(column)));
    run.methods[s].metrics.judge_difference = differences(column);
    run.methods[s].metrics.judge_difference_target = target_differences(column);
  }
  run.judge = scene.judge.kind == JudgeSpec::Kind::kSame    ? "truth"
              : scene.judge.kind == JudgeSpec::Kind::kSplit ? "split"
                                                            : "edge";
  run.judge_model = std::move(judge_model);
}

void warn_of_conditioning(const MethodSolver& solver, Run& run, Progress& progress) {
  const double reciprocal = timed(progress, run.seconds, "condition", "estimate the condition number of B",
                                  [&] { return solver.scattering().reciprocal_condition(); });
  if (reciprocal < kSmallestReciprocalCondition) {
    warn({fmt::format("ill_conditioned: B has a condition number of about {:.1e}; the pressure may keep fewer than "
                      "eight digits of its own system",
                      1.0 / reciprocal)},
         run, progress);
  }
}

void raise_alarm(const Scene& scene, Models& models, Run& run, Progress& progress) {
  const MethodSpec& first = scene.solve.methods.front();
  double spent = 0.0;
  for (const SolveRecord& solve : run.solves) {
    spent += solve.seconds;
  }
  run.alarm = timed(progress, run.seconds, "alarm", "compare plain and Burton-Miller pressures", [&] {
    return fictitious_alarm(models.of(first.scheme).scattering(), scene.solve.solver,
                            drive(run.methods.front().solution), run.methods.front().pressure, spent, run.solves,
                            progress);
  });
}

FieldResult evaluate_grid(const FieldGrid& grid, const Model& model, const Run& run) {
  FieldValues values =
      evaluate_field(run.mesh, run.array, model.wave, grid.points(), pressures_of(run), drives_of(run));
  FieldResult field{grid, std::move(values.inside), {}};
  for (std::size_t s = 0; s < run.methods.size(); ++s) {
    field.pressure.emplace_back(run.methods[s].name, values.pressure.col(static_cast<Eigen::Index>(s)));
  }
  return field;
}

void write_vtk(const Scene& scene, const Run& run, const RunDirectory& directory) {
  if (scene.write.vtp) {
    write_surface_vtp(directory.file("surface.vtp"), run);
    write_array_vtp(directory.file("array.vtp"), run);
    if (run.judge_model) {
      write_judge_vtp(directory.file("judge.vtp"), run);
    }
  }
  if (scene.write.vti) {
    for (const FieldResult& field : run.fields) {
      write_field_vti(directory.file(field.grid.name + ".vti"), run, field);
    }
  }
}

void draw(const Run& run, const RunDirectory& directory, Progress& progress) {
  if (!can_draw()) {
    progress.warn("no display answers, so no pictures are drawn; scripts/run or xvfb-run -a gives the program one");
    return;
  }
  std::vector<std::pair<std::string, double>> unused;
  timed(progress, unused, "pictures", "draw pictures", [&] { draw_figures(directory.path(), run); });
}

}  // namespace

Run run_scene(const Scene& scene, const Model& model, const RunOptions& options, RunDirectory& directory,
              Progress& progress) {
  Run run = begin_run(scene, model, options);
  std::vector<std::string> names;
  for (const MethodSpec& method : scene.solve.methods) {
    names.push_back(method.name);
  }
  directory.plan(names);

  if (const std::string slow = blas_warning(); !slow.empty()) {
    progress.warn(slow);  // of this process, not of the result
  }
  warn(model_warnings(model), run, progress);
  Models models(scene, model, options, run, progress);
  if (scene.target && !scene.target->pressure) {
    const MethodSpec& first = scene.solve.methods.front();
    const auto find_scale = [&] {
      return models.of(first.scheme).best_scale(first, run.mesh, model.wave, model.boxes, progress);
    };
    run.target->amplitudes *= timed(progress, run.seconds, "scale",
                                    fmt::format("find the target's best pressure for {}", first.name), find_scale);
  }
  for (const MethodSpec& method : scene.solve.methods) {
    run.methods.push_back(solve_method(method, scene, models, model, run, progress));
    write_tables(scene, run, directory);
    directory.finished(method.name);
  }
  warn_of_conditioning(models.of(scene.solve.methods.front().scheme), run, progress);
  raise_alarm(scene, models, run, progress);
  if (judged_elsewhere(scene)) {
    judge_elsewhere(scene, model, options, run, progress);
  }
  if (scene.solve.certificate && run.target) {
    certify_methods(scene, models, run, progress);
  }
  warn(result_warnings(run, scene.solve.methods.front().scheme), run, progress);
  for (const FieldGrid& grid : model.fields) {
    run.fields.push_back(timed(progress, run.seconds, "field_" + grid.name,
                               fmt::format("field {}: {} points", grid.name, grid.size()),
                               [&] { return evaluate_grid(grid, model, run); }));
  }
  run.complete = true;
  run.provenance.end = utc_now();
  timed(progress, run.seconds, "write", "write results", [&] {
    write_vtk(scene, run, directory);
    write_tables(scene, run, directory);
  });
  if (scene.write.png) {
    draw(run, directory, progress);
  }
  return run;
}

}  // namespace touchfield
