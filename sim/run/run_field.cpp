#include "sim/run/run_field.h"

#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/sincos.h"
#include "sim/gpu/field_on_card.h"

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
  if (method.evaluation_pressure.size() != mesh.face_count()) {
    throw InputError(
        fmt::format("method {}: the evaluation mesh has no pressure of it, which its field needs", method.name));
  }
  return method.evaluation_pressure;
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
  return run.has_fields_of_evaluation() ? run.evaluation_model->mesh : run.mesh;
}

FieldValues run_field(const Run& run, const Wave& wave, const Points& points, Gpu* gpu) {
  const TriangleMesh& mesh = field_mesh(run);
  if (!run.has_fields_of_evaluation()) {
    return field_by(gpu, mesh, run.array, wave, points, pressures_of(run), drives_of(run));
  }
  TransducerArray array = run.array;
  if (run.array_truth) {
    array.response = run.array_truth->response;
  }
  const auto pressures = columns_of(run, mesh.face_count(), [&](const MethodResult& method) -> const Eigen::VectorXcd& {
    return evaluated_pressure(method, mesh);
  });
  return field_by(gpu, mesh, array, wave, points, pressures, sounding_drives(run));
}

}  // namespace touchfield
