#pragma once

#include "sim/field/evaluate.h"
#include "sim/gpu/gpu.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// Drives of all methods of a run as they were solved, N x S, and the pressures that the solver finds for them, M x S.
Eigen::MatrixXcd drives_of(const Run& run);
Eigen::MatrixXcd pressures_of(const Run& run);

/// The drives that sound: rounded to the steps of the true array.
Eigen::MatrixXcd sounding_drives(const Run& run);
/// Of one solution.
Eigen::VectorXcd sounding_drive(PhaseSolution solution, const std::optional<ArrayTruth>& truth);

/// The mesh on which run_field knows the pressures: the solving one, or the evaluation's where the array has a truth.
const TriangleMesh& field_mesh(const Run& run);

/// The field of all methods off the skin, a column each. Where the array has a truth it is the truth's: its channels,
/// what sounds, and the evaluation's pressures on the evaluation mesh.
///
/// points   3 x J [m]
/// gpu      a card to sum over faces where that pays; null: the processor does
/// throws   InputError if the array has a truth and a method no pressure of the evaluation; GpuMemoryFailure where the
///          card has no room, DeviceError where it fails
FieldValues run_field(const Run& run, const Wave& wave, const Points& points, Gpu* gpu = nullptr);

}  // namespace touchfield
