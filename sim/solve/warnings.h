#pragma once

#include <string>
#include <vector>

#include "sim/solve/model.h"
#include "sim/store/run_data.h"

namespace touchfield {

/// What in a model makes its results less than trustworthy, each as "name: what, with the figure". docs/stability.md
/// says what was measured on such cases.
///
///   mesh_unit       a mesh file in a unit that makes it no body of a person
///   coarse_mesh     fewer than 3 edges a wavelength
///   slivers         an angle below 10 degrees
///   size_jump       faces that share an edge differ more than 3 times in size
///   narrow_gap      two parts of the skin look at each other through less than one edge of air
///   thin_body       the same through less than two edges of the body
///   behind_array    more than half of the transducers, which radiate ahead, point away from the target or the body
///   near_source     a transducer nearer to the skin than a local edge
std::vector<std::string> model_warnings(const Model& model);

/// The same for what a run found, in its present state.
///
///   not_converged         a solve that missed its tolerance
///   fictitious_frequency  a scheme without a cure for them differs from Burton-Miller by more than 10 %
///   deep_shadow           the target is so quiet that errors of the loud skin count twice or more there
std::vector<std::string> result_warnings(const Run& run, Scheme scheme);

}  // namespace touchfield
