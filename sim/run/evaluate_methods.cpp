#include "sim/run/evaluate_methods.h"

#include <memory>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "sim/acoustics/incident_field.h"
#include "sim/core/errors.h"
#include "sim/core/sincos.h"
#include "sim/field/metrics.h"
#include "sim/gpu/on_card.h"
#include "sim/model/evaluation.h"
#include "sim/model/stages.h"

namespace touchfield {

namespace {

constexpr double kLeastPairsOnCard = 1e7;  // of points and faces: fewer take the processor milliseconds

/// A column a method.
template <class Column>
Eigen::MatrixXcd columns_of(const Run& run, Eigen::Index rows, const Column& column) {
  Eigen::MatrixXcd columns(rows, static_cast<Eigen::Index>(run.methods.size()));
  for (std::size_t s = 0; s < run.methods.size(); ++s) {
    columns.col(static_cast<Eigen::Index>(s)) = column(run.methods[s]);
  }
  return columns;
}

const Eigen::VectorXcd& evaluated_pressure(const MethodResult& method, const TriangleMesh& mesh) {
  const Eigen::VectorXcd& pressure =
      method.evaluation_pressure.size() > 0 ? method.evaluation_pressure : method.pressure;
  if (pressure.size() != mesh.face_count()) {
    throw InputError(
        fmt::format("method {}: the evaluation mesh has no pressure of it, which its field needs", method.name));
  }
  return pressure;
}

FieldValues field_by(Gpu* gpu, const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                     const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive) {
  const double pairs = static_cast<double>(points.cols()) * static_cast<double>(mesh.face_count());
  if (gpu == nullptr || pairs < kLeastPairsOnCard) {
    return evaluate_field(mesh, array, wave, points, surface, drive);
  }
  FarField far = far_field_on_card(*gpu, kFarDistance, mesh, array, wave, points, surface, drive);
  return with_near_faces(mesh, wave, points, surface, std::move(far.pressure), far.winding, far.near);
}

/// The drives that sound: rounded to the steps of the true array.
Eigen::MatrixXcd sounding_drives(const Run& run) {
  const int levels = run.array_truth ? run.array_truth->phase_levels : 0;
  return columns_of(run, run.array.size(),
                    [&](const MethodResult& method) { return sounding_drive(method.solution, levels); });
}

/// The evaluation's pressures of the drives that sound. Where only the channels are others the system is the solver's,
/// made and factorised already.
std::unique_ptr<SkinScattering> evaluation_scattering(const Model& model, const SolveOptions& options,
                                                      const TriangleMesh& mesh,
                                                      const std::function<SkinScattering&()>& own, Run& run,
                                                      Progress& progress) {
  const Evaluation& evaluation = model.fixed->evaluation;
  if (evaluation.kind == Evaluation::Kind::kTruth && !model.truth) {
    return std::make_unique<SkinScattering>(own(), evaluation.channels.response);
  }
  SolverSpec spec = model.fixed->scene.solve.solver;
  spec.solver = SolverChoice::kAuto;
  spec.precision = PrecisionChoice::kAuto;
  return make_scattering("evaluation", mesh, evaluation.scheme, spec, static_cast<Eigen::Index>(run.methods.size()),
                         model, evaluation.channels.response, options.models, run.solves, progress);
}

}  // namespace

Eigen::MatrixXcd drives_of(const Run& run) {
  return columns_of(run, run.array.size(), [](const MethodResult& method) { return drive(method.solution); });
}

Eigen::MatrixXcd pressures_of(const Run& run) {
  return columns_of(run, run.mesh.face_count(), [](const MethodResult& method) { return method.pressure; });
}

Eigen::VectorXcd sounding_drive(PhaseSolution solution, int phase_levels) {
  if (phase_levels > 0) {
    for (double& phase : solution.phases) {
      phase = 2.0 * std::numbers::pi * phase_step(phase, phase_levels) / phase_levels;
    }
  }
  return drive(solution);
}

FieldValues run_field(const Run& run, const Wave& wave, const Points& points, Gpu* gpu) {
  const TriangleMesh& mesh = evaluated_mesh(run);
  TransducerArray array = run.array;
  if (run.array_truth) {
    array.response = run.array_truth->response;
  }
  const auto pressures = columns_of(run, mesh.face_count(), [&](const MethodResult& method) -> const Eigen::VectorXcd& {
    return evaluated_pressure(method, mesh);
  });
  return field_by(gpu, mesh, array, wave, points, pressures, sounding_drives(run));
}

void note_solve(const Run& run, Progress& progress) {
  const SolveRecord& solve = run.solves.back();
  progress.detail(fmt::format("    {}: {} step{}, {} refinement{}, residual {:.1e}{}", solve.stage, solve.steps,
                              solve.steps == 1 ? "" : "s", solve.refinements, solve.refinements == 1 ? "" : "s",
                              solve.residual, solve.converged ? "" : ", NOT CONVERGED"));
}

void evaluate_method(MethodResult& result, const TriangleMesh& mesh, const SurfaceGradient& gradient,
                     const Model& model, const std::optional<Target>& target, const Eigen::VectorXcd& pressure) {
  Metrics metrics;
  if (model.fixed->cut.empty() || result.evaluation_pressure.size() > 0) {
    result.radiation = radiation_pressure(gradient, model.fixed->wave, pressure);
    metrics = target ? metrics_of(mesh, model.boxes, *target, pressure, result.radiation)
                     : metrics_of(mesh, pressure, result.radiation);
  }
  if (!result.solution.cost_history.empty()) {
    metrics.cost = result.solution.cost_history.back();
  }
  metrics.iterations = result.solution.iterations;
  metrics.power_share =
      result.solution.amplitudes.squaredNorm() / static_cast<double>(result.solution.amplitudes.size());
  metrics.seconds_solve = result.seconds.front().second;
  metrics.seconds_total = 0.0;
  for (const auto& [stage, seconds] : result.seconds) {
    metrics.seconds_total += seconds;
  }
  result.metrics = metrics;
  if (model.fixed->array.kind == TransducerArray::Kind::kTransducers) {
    Eigen::Index loudest = 0;
    pressure.cwiseAbs().maxCoeff(&loudest);
    const Vector3 at = mesh.centroids().col(loudest);
    TransducerArray array = model.fixed->array;
    array.response = model.fixed->evaluation.channels.response;
    result.shock_distance_share = shock_distance_share(array, model.fixed->wave, drive(result.solution),
                                                       wave_front_begin(array, model.fixed->wave, at), at);
  }
}

void evaluate_elsewhere(const Model& model, const SolveOptions& options, const std::function<SkinScattering&()>& own,
                        Run& run, Progress& progress) {
  const Scene& scene = model.fixed->scene;
  const Evaluation& evaluation = model.fixed->evaluation;
  const EvaluationMesh evaluation_mesh = timed(progress, run.seconds, "evaluation_mesh", "evaluation mesh",
                                               [&] { return evaluation.mesh(model, options.bodies); });
  const TriangleMesh& mesh = evaluation_mesh.mesh;
  EvaluationModel evaluation_model{to_string(evaluation.scheme), mesh, std::nullopt};
  if (scene.target) {
    evaluation_model.target = build_target(model, mesh);
    if (!scene.target->pressure) {  // the scale that was found for the solving mesh
      evaluation_model.target->amplitudes *=
          run.target->amplitudes.maxCoeff() / evaluation_model.target->amplitudes.maxCoeff();
    }
  }
  auto scattering =
      timed(progress, run.seconds, "evaluation_set_up",
            fmt::format("set up the evaluation mesh: {} on {} faces", evaluation_model.scheme, mesh.face_count()),
            [&] { return evaluation_scattering(model, options, mesh, own, run, progress); });
  progress.detail(describe_decision(*scattering));
  const Eigen::MatrixXcd pressures =
      timed(progress, run.seconds, "evaluation", fmt::format("evaluate {} methods", run.methods.size()),
            [&] { return scattering->pressure(sounding_drives(run), "evaluation"); });
  note_solve(run, progress);
  require_finite("evaluation", pressures);
  const Eigen::MatrixXcd believed = pressures_of(run);
  const Eigen::VectorXd differences =
      EvaluationComparison(run.mesh, mesh, evaluation_mesh.splits, model.fixed->skin).differences(believed, pressures);
  Eigen::VectorXd target_differences = Eigen::VectorXd::Constant(differences.size(), kNotComputed);
  if (run.target) {
    std::vector<unsigned char> near = target_surroundings(run.mesh, run.target->faces);
    for (std::size_t f = 0; f < near.size(); ++f) {
      near[f] = near[f] != 0 && model.fixed->skin[f] != 0 ? 1 : 0;
    }
    target_differences =
        EvaluationComparison(run.mesh, mesh, evaluation_mesh.splits, near).differences(believed, pressures);
  }
  const SurfaceGradient gradient(mesh, model.fixed->wave.k());
  for (std::size_t s = 0; s < run.methods.size(); ++s) {
    const auto column = static_cast<Eigen::Index>(s);
    run.methods[s].evaluation_pressure = pressures.col(column);
    evaluate_method(run.methods[s], mesh, gradient, model, evaluation_model.target, pressures.col(column));
    run.methods[s].metrics.evaluation_difference = differences(column);
    run.methods[s].metrics.evaluation_difference_target = target_differences(column);
  }
  run.evaluation = to_string(evaluation.kind);
  run.evaluation_model = std::move(evaluation_model);
}

}  // namespace touchfield
