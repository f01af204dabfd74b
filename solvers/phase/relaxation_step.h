#pragma once

#include "solvers/phase/dual_factor.h"
#include "solvers/phase/low_rank_relaxation.h"

namespace touchfield {

/// One step of Newton's method on the spheres, regularised by sigma and solved by conjugate gradients,
///
///   (Hess F / 2 + sigma) eta = -gradient,
///
/// preconditioned by the inverse of S + sigma with the part of the Hessian that acts along a_j Y added. S + sigma >= 0
/// makes the left-hand side definite.
///
/// factor    of S + sigma at the point's positive_loudness and d
/// gain      (F - F_new) over what the model foretold; NaN where it foretold nothing
/// returns   the point stepped to, better or not
RelaxedPoint newton_step(const LowRankRelaxation& relaxation, const RelaxedPoint& point, DualFactor& factor,
                         double sigma, double& gain);

}  // namespace touchfield
