#include "sim/solve/judge.h"

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/field/pressure_metrics.h"
#include "sim/solve/judge_comparison.h"
#include "sim/solve/stages.h"

namespace touchfield {

namespace {

/// A column a method.
template <class Column>
Eigen::MatrixXcd columns_of(const Run& run, Eigen::Index rows, const Column& column) {
  Eigen::MatrixXcd columns(rows, static_cast<Eigen::Index>(run.methods.size()));
  for (std::size_t s = 0; s < run.methods.size(); ++s) {
    columns.col(static_cast<Eigen::Index>(s)) = column(run.methods[s]);
  }
  return columns;
}

}  // namespace

void note_solve(const Run& run, Progress& progress) {
  const SolveRecord& solve = run.solves.back();
  progress.note(fmt::format("    {}: {} step{}, {} refinement{}, residual {:.1e}{}", solve.stage, solve.steps,
                            solve.steps == 1 ? "" : "s", solve.refinements, solve.refinements == 1 ? "" : "s",
                            solve.residual, solve.converged ? "" : ", NOT CONVERGED"));
}

void require_finite(const std::string& what, const Eigen::MatrixXcd& pressure) {
  if (!pressure.allFinite()) {
    throw NumericalError(fmt::format("{}: the scattered pressure is not finite", what));
  }
}

Eigen::MatrixXcd drives_of(const Run& run) {
  return columns_of(run, run.array.size(), [](const MethodResult& method) { return drive(method.solution); });
}

Eigen::MatrixXcd pressures_of(const Run& run) {
  return columns_of(run, run.mesh.face_count(), [](const MethodResult& method) { return method.pressure; });
}

Metrics metrics_on(const TriangleMesh& mesh, const SurfaceGradient& gradient, const Model& model,
                   const std::optional<Target>& target, const Eigen::VectorXcd& pressure) {
  return target ? metrics_of(mesh, gradient, model.wave, model.boxes, *target, pressure)
                : metrics_of(mesh, gradient, model.wave, pressure);
}

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

void judge_elsewhere(const Model& model, const SolveOptions& options, Run& run, Progress& progress) {
  const Scene& scene = model.scene;
  const JudgeMesh judge_mesh = timed(progress, run.seconds, "judge_mesh", "mesh of the judge",
                                     [&] { return build_judge_mesh(model, options.bodies); });
  const TriangleMesh& mesh = judge_mesh.mesh;
  const Scheme scheme = scene.judge.kind == JudgeSpec::Kind::kSame ? scene.solve.scheme : scene.judge.scheme;
  JudgeModel judge_model{to_string(scheme), mesh, std::nullopt};
  if (scene.target) {
    judge_model.target = build_target(model, mesh);
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
                                     options.models, run.solves, progress);
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
  const SurfaceGradient gradient(mesh, model.wave.k());
  for (std::size_t s = 0; s < run.methods.size(); ++s) {
    const auto column = static_cast<Eigen::Index>(s);
    run.methods[s].judge_pressure = pressures.col(column);
    set_metrics(run.methods[s], metrics_on(mesh, gradient, model, judge_model.target, pressures.col(column)));
    run.methods[s].metrics.judge_difference = differences(column);
    run.methods[s].metrics.judge_difference_target = target_differences(column);
  }
  run.judge = scene.judge.kind == JudgeSpec::Kind::kSame    ? "truth"
              : scene.judge.kind == JudgeSpec::Kind::kSplit ? "split"
                                                            : "edge";
  run.judge_model = std::move(judge_model);
}

}  // namespace touchfield
