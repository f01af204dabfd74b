#pragma once

#include "sim/bem/scheme.h"
#include "sim/solve/model.h"

namespace touchfield {

/// Steps that GMRES will take for one drive to the tolerance that scenes have unless they say otherwise, 1e-4.
///
/// Sound that is caught between folded fingers takes two to three times the steps of an open hand, which nothing but
/// solving tells. So a large body is solved on a coarse copy, 0.7 of the wavelength an edge (some tenths of a second),
/// whose steps are nearly those of any finer mesh where nothing is caught, and grow as edge^-0.35 where it is. Within
/// 15 % on the built-in hand's poses, 11,000 to 100,000 faces (docs/speed-and-error.md). A body of up to 15,000 faces,
/// or one too thin for the coarse copy, gets 25 by a Burton-Miller scheme, 200 by another.
double expected_steps(const Model& model, Scheme scheme);

}  // namespace touchfield
