#include "sim/solve/run_field.h"

#include <numbers>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/phase_step.h"

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

const Eigen::VectorXcd& judged_pressure(const MethodResult& method, const TriangleMesh& mesh) {
  if (method.judge_pressure.size() != mesh.face_count()) {
    throw InputError(fmt::format("method {}: the judge has no pressure of it, which its field needs", method.name));
  }
  return method.judge_pressure;
}

}  // namespace

Eigen::MatrixXcd drives_of(const Run& run) {
  return columns_of(run, run.array.size(), [](const MethodResult& method) { return drive(method.solution); });
}

Eigen::MatrixXcd pressures_of(const Run& run) {
  return columns_of(run, run.mesh.face_count(), [](const MethodResult& method) { return method.pressure; });
}

Eigen::VectorXcd sounding_drive(PhaseSolution solution, const std::optional<ArrayTruth>& truth) {
  const int levels = truth ? truth->phase_levels : 0;
  if (levels > 0) {
    for (double& phase : solution.phases) {
      phase = 2.0 * std::numbers::pi * phase_step(phase, levels) / levels;
    }
  }
  return drive(solution);
}

Eigen::MatrixXcd sounding_drives(const Run& run) {
  return columns_of(run, run.array.size(),
                    [&](const MethodResult& method) { return sounding_drive(method.solution, run.array_truth); });
}

const TriangleMesh& field_mesh(const Run& run) {
  return run.array_truth && run.judge_model ? run.judge_model->mesh : run.mesh;
}

FieldValues run_field(const Run& run, const Wave& wave, const Points& points) {
  const TriangleMesh& mesh = field_mesh(run);
  if (!run.array_truth) {
    return evaluate_field(mesh, run.array, wave, points, pressures_of(run), drives_of(run));
  }
  TransducerArray array = run.array;
  array.response = run.array_truth->response;
  const auto pressures = columns_of(run, mesh.face_count(), [&](const MethodResult& method) -> const Eigen::VectorXcd& {
    return judged_pressure(method, mesh);
  });
  return evaluate_field(mesh, array, wave, points, pressures, sounding_drives(run));
}

}  // namespace touchfield
