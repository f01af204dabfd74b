#pragma once

#include "sim/bem/scheme.h"
#include "sim/model/model.h"

namespace touchfield {

/// Steps that GMRES will take for one drive to the default tolerance of scenes, 1e-4.
///
/// Sound that is caught between folded fingers takes two to three times the steps of an open hand. Only a solution
/// shows this. So for a Burton-Miller scheme a large body is solved on a coarse copy with edges of 0.7 wavelengths
/// (some tenths of a second). Where nothing is caught, the steps on the copy are nearly those of any finer mesh. Where
/// sound is caught (32 steps or more on the copy), they grow as edge^-0.35. This is within 15 % on the built-in hand's
/// poses with 11,000 to 100,000 faces (docs/speed-and-error.md).
///
/// A Burton-Miller scheme gets 25 without a copy. There is no copy for up to 15,000 faces, for a mean edge above 0.49
/// wavelengths, and where the body is too thin for it. Any other scheme gets 200.
double expected_steps(const Model& model, Scheme scheme);

}  // namespace touchfield
