#pragma once

#include <string>

#include "sim/store/run_data.h"

/// Every file holds the run's provenance as field data, a text array each, named as in /provenance of run.h5, and the
/// resolved scene as `scene`.
namespace touchfield {

/// surface.vtp: the solving mesh with per-face arrays `target_pa` (0 off target) and, for every method NAME,
/// `NAME_abs_pa`, `NAME_re_pa`, `NAME_im_pa`, `NAME_phase_rad`. Inline binary with zlib, whole or not at all.
void write_surface_vtp(const std::string& path, const Run& run);

/// judge.vtp: the same of the judge's mesh, its target and its pressures.
///
/// throws   InputError if the judge has no model of its own
void write_judge_vtp(const std::string& path, const Run& run);

/// array.vtp: a vertex a channel with `axis`, `device`, `channel` and, for every method NAME, `NAME_phase_rad` and
/// `NAME_amplitude`.
void write_array_vtp(const std::string& path, const Run& run);

/// A .vti of one field of a run: `inside` and, for every method NAME, `NAME_abs_pa`, `NAME_re_pa`, `NAME_im_pa` as
/// point data.
void write_field_vti(const std::string& path, const Run& run, const FieldResult& field);

}  // namespace touchfield
