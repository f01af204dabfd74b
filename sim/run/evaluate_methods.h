#pragma once

#include <functional>
#include <optional>

#include "sim/core/progress.h"
#include "sim/field/evaluate.h"
#include "sim/field/surface_gradient.h"
#include "sim/gpu/gpu.h"
#include "sim/model/model.h"
#include "sim/run/run_data.h"
#include "sim/run/skin_scattering.h"

namespace touchfield {

/// Drives of all methods of a run as they were solved, N x S, and the pressures that the solver finds for them, M x S.
Eigen::MatrixXcd drives_of(const Run& run);
Eigen::MatrixXcd pressures_of(const Run& run);

/// Of one solution.
/// phase_levels   as of ArrayTruth
Eigen::VectorXcd sounding_drive(PhaseSolution solution, int phase_levels);

/// The field of all methods off the skin, a column each, of the pressures on evaluated_mesh. Where the array has a
/// truth, it is of its channels and of what sounds.
///
/// points   3 x J [m]
/// gpu      a card to sum over faces where that pays; null: the processor does
/// throws   InputError if a method has no pressure of the evaluation; GpuMemoryFailure where the card has no
///          room, DeviceError where it fails
FieldValues run_field(const Run& run, const Wave& wave, const Points& points, Gpu* gpu = nullptr);

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

void note_solve(const Run& run, Progress& progress);

}  // namespace touchfield
