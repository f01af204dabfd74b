#pragma once

#include <optional>
#include <string>

#include "sim/core/progress.h"
#include "sim/field/surface_gradient.h"
#include "sim/solve/model.h"
#include "sim/solve/solve_model.h"
#include "sim/store/run_data.h"

namespace touchfield {

/// The scores of a pressure on a mesh: against the target where the scene has one.
Metrics metrics_on(const TriangleMesh& mesh, const SurfaceGradient& gradient, const Model& model,
                   const std::optional<Target>& target, const Eigen::VectorXcd& pressure);

/// A judge's metrics take the place of what was there; what the method itself knows stays.
void set_metrics(MethodResult& result, Metrics metrics);

/// Every method on the judge's own mesh, all of them at once.
/// throws   NumericalError if a pressure is not finite
void judge_elsewhere(const Model& model, const SolveOptions& options, Run& run, Progress& progress);

/// Drives and pressures of all methods of a run, a column each.
Eigen::MatrixXcd drives_of(const Run& run);
Eigen::MatrixXcd pressures_of(const Run& run);

/// A line on the last solve of a run.
void note_solve(const Run& run, Progress& progress);

/// throws   NumericalError that names `what`
void require_finite(const std::string& what, const Eigen::MatrixXcd& pressure);

}  // namespace touchfield
