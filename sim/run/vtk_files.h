#pragma once

#include <string>
#include <vector>

#include "sim/run/felt.h"
#include "sim/run/motion_data.h"
#include "sim/run/run_data.h"

/// Every .vtp and .vti holds the provenance of its result as field data. Each entry is a text array, named as in
/// /provenance of run.h5. The resolved scene is in `scene`.
namespace touchfield {

/// surface.vtp: the solving mesh. Inline binary with zlib, whole or not at all. Its arrays, for every method NAME:
///
///   body             per face, the number of the body it is of; only where the run has it
///   target_pa        per face, 0 off target
///   NAME_abs_pa      per face; also per vertex, the mean over its faces by area, for views that share colours
///                    with fields
///   NAME_re_pa, NAME_im_pa, NAME_phase_rad   per face
void write_surface_vtp(const std::string& path, const Run& run);

/// evaluation.vtp: the same of the evaluation mesh, its target and its pressures.
///
/// throws   InputError if the evaluation has no model of its own
void write_evaluation_vtp(const std::string& path, const Run& run);

/// felt.vtp: the evaluated skin. Its arrays are per face, NaN off the patch, for every method NAME and layered SKIN:
///
///   NAME_radiation_rms_pa, NAME_SKIN_displacement_m   root mean square over time
///   NAME_SKIN_energy_pc_j_m3                          mean strain energy density at the Pacinian depth
void write_felt_vtp(const std::string& path, const Felt& felt);

/// array.vtp: one vertex per channel with `axis`, `device`, `channel` and, for every method NAME, `NAME_phase_rad` and
/// `NAME_amplitude`.
void write_array_vtp(const std::string& path, const Run& run);
/// The same of a motion, whose methods have phases in frames: without them.
void write_array_vtp(const std::string& path, const Motion& motion);

/// A .vti of one field of a run: `inside` and, for every method NAME, `NAME_abs_pa`, `NAME_re_pa`, `NAME_im_pa` as
/// point data.
void write_field_vti(const std::string& path, const Run& run, const FieldResult& field);

/// A .vtm, which ParaView opens as one data set whose blocks are other files; these are named as seen from its folder.
void write_blocks(const std::string& path, const std::vector<std::string>& files);

/// A file of a series and its time [s].
struct SeriesStep {
  double time = 0;
  std::string file;  // relative to the series' own
};

/// A .pvd, which ParaView opens as one data set over time. Whole or not at all.
void write_series(const std::string& path, const std::vector<SeriesStep>& steps);

/// Adds an instant of a motion to the series evaluation.pvd of a directory: evaluation_0001.vtp, evaluation_0002.vtp,
/// ... with the evaluated skin as in evaluation.vtp, and evaluation.pvd again, so that it is always of all files that
/// are there.
///
/// steps    those before it, none at first; then with this one
/// throws   InputError if the parts of the instant do not fit each other; IoError
void add_to_series(const std::string& directory, const Motion& motion, const MotionInstant& instant,
                   std::vector<SeriesStep>& steps);

}  // namespace touchfield
