#include "sim/run/evaluation.h"

#include <memory>

#include <fmt/format.h>

#include "sim/acoustics/nonlinearity.h"
#include "sim/core/errors.h"
#include "sim/field/metrics.h"
#include "sim/model/evaluation_comparison.h"
#include "sim/model/stages.h"
#include "sim/run/kept_models.h"
#include "sim/run/run_field.h"

namespace touchfield {

namespace {

/// The evaluation's pressures of the drives that sound. Where only the channels are others the system is the solver's,
/// made and factorised already.
std::unique_ptr<SkinScattering> evaluation_scattering(const Model& model, const SolveOptions& options,
                                                      const TriangleMesh& mesh, Scheme scheme,
                                                      const std::function<SkinScattering&()>& own, Run& run,
                                                      Progress& progress) {
  const ChannelResponse& response =
      model.fixed->array_truth ? model.fixed->array_truth->response : model.fixed->array.response;
  if (model.fixed->scene.evaluation.kind == EvaluationSpec::Kind::kSame && !model.truth &&
      !evaluates_own_bodies(model)) {
    return std::make_unique<SkinScattering>(own(), response);
  }
  SolverSpec spec = model.fixed->scene.solve.solver;
  spec.solver = SolverChoice::kAuto;
  spec.precision = PrecisionChoice::kAuto;
  return make_scattering("evaluation", mesh, scheme, spec, static_cast<Eigen::Index>(run.methods.size()), model,
                         response, options.models, run.solves, progress);
}

}  // namespace

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
    metrics = target ? metrics_of(mesh, gradient, model.fixed->wave, model.boxes, *target, pressure)
                     : metrics_of(mesh, gradient, model.fixed->wave, pressure);
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
    if (model.fixed->array_truth) {
      array.response = model.fixed->array_truth->response;
    }
    result.shock_distance_share = shock_distance_share(array, model.fixed->wave, drive(result.solution),
                                                       wave_front_begin(array, model.fixed->wave, at), at);
  }
}

void evaluate_elsewhere(const Model& model, const SolveOptions& options, const std::function<SkinScattering&()>& own,
                        Run& run, Progress& progress) {
  const Scene& scene = model.fixed->scene;
  const EvaluationMesh evaluation_mesh = timed(progress, run.seconds, "evaluation_mesh", "evaluation mesh",
                                               [&] { return build_evaluation_mesh(model, options.bodies); });
  const TriangleMesh& mesh = evaluation_mesh.mesh;
  const Scheme scheme = evaluation_scheme(scene);
  EvaluationModel evaluation_model{to_string(scheme), mesh, std::nullopt};
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
            [&] { return evaluation_scattering(model, options, mesh, scheme, own, run, progress); });
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
  run.evaluation = evaluates_own_bodies(model)                             ? "edge"
                   : scene.evaluation.kind == EvaluationSpec::Kind::kSplit ? "split"
                                                                           : "truth";
  run.evaluation_model = std::move(evaluation_model);
}

}  // namespace touchfield
