#pragma once

#include <functional>
#include <optional>
#include <string>

#include "sim/core/progress.h"
#include "sim/field/surface_gradient.h"
#include "sim/model/model.h"
#include "sim/run/run_data.h"
#include "sim/run/solve_options.h"

namespace touchfield {

/// Scores a method by its pressure on a mesh, against the target where there is one. On a part of the skin only what
/// needs no skin is scored. Except for a plane wave, also computes how far its sound has steepened on the way to the
/// loudest face. The scores of an evaluation replace those that were there.
void evaluate_method(MethodResult& result, const TriangleMesh& mesh, const SurfaceGradient& gradient,
                     const Model& model, const std::optional<Target>& target, const Eigen::VectorXcd& pressure);

/// Every method by the evaluation's own model, all of them at once.
///
/// own      the solving model in the scene's scheme: of use where only the channels are others
/// throws   NumericalError if a pressure is not finite
void evaluate_elsewhere(const Model& model, const SolveOptions& options, const std::function<SkinScattering&()>& own,
                        Run& run, Progress& progress);

/// A line on the last solve of a run.
void note_solve(const Run& run, Progress& progress);

}  // namespace touchfield
