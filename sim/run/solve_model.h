#pragma once

#include <functional>
#include <string>

#include "sim/core/progress.h"
#include "sim/model/model.h"
#include "sim/run/run_data.h"
#include "sim/run/skin_scattering.h"

namespace touchfield {

/// Computes a scene: B p = G q assembled and factorised, every method solved and evaluated by the scattered pressure
/// p = B^-1 G q, then the fields. No file is written.
///
/// finished   gets the run so far after each method
/// throws     NumericalError if a matrix is singular, too ill-conditioned or a residual above 100 tolerances, all of
///            that before phases are solved where it shows then, or if a pressure is not finite; and what `finished`
///            throws. A solve that misses its tolerance by less is a warning of the run
Run solve_model(const Model& model, const SolveOptions& options, const std::function<void(const Run&)>& finished,
                Progress& progress);
/// The same in silence, on all threads of OpenMP.
Run solve_model(const Model& model);

/// The seeds of a scene, "name=value" separated by spaces.
std::string used_seeds(const Scene& scene);

/// The scheme whose matrix a method works on; "none" of the free field and of given phases.
std::string scheme_of(const MethodSpec& method);

/// The graphics card that solves were made by, with its driver's and its toolkit's version; empty if there is none.
std::string used_card(const std::vector<SolveRecord>& solves);

/// Where results that begin now come from: this program, this machine and its processor's kernels, the time. The end is
/// left empty.
Provenance provenance_now(int threads, const std::string& seeds, const std::string& command_line,
                          const std::string& scene_hash);

}  // namespace touchfield
