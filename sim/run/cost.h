#pragma once

#include <string>

#include "sim/model/model.h"
#include "sim/run/solver_choice.h"

namespace touchfield {

/// What one scattering model takes beside its mesh: its matrix, grid or Krylov space, near pairs, and its solves.
/// Estimates, within a factor of two.
struct ModelCost {
  double bytes = 0;
  double seconds = 0;
  std::string note;  // empty, or why the seconds are a guess
};

/// What Burton-Miller's near corrections take while they are gathered, on a uniform mesh [bytes].
double near_memory(double faces);

/// faces, unknowns   of the system; they differ for chief
/// solves            right-hand sides, solved one after another
/// steps             of GMRES for each, where it solves (expected_steps.h)
/// product           seconds of a direct product with D in single precision on this mesh (product_seconds)
/// grid              solver_grid() of this mesh; read where products go through it
ModelCost scattering_cost(const SolverDecision& decision, Scheme scheme, double faces, double unknowns, double solves,
                          double steps, double product, const GridChoice& grid);

/// Points inside the body that a CHIEF system will have, about: one a cube of the spacing in its volume.
double chief_points(const Model& model);

}  // namespace touchfield
