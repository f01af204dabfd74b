#pragma once

#include "solvers/phase/surface.h"

namespace touchfield {

/// solve_surface from the most promising of several starts. These are the two lowest of five annealed ones
/// (annealed_start.h), zero after five steps, and `others`. Each takes three steps, then the lowest path continues. It
/// ends when `iterations` are done, or when six of them together lower the cost by less than 2e-4 of it. On problems
/// with traps single starts end up to 30 % above one another. The search takes about twice the time of one of them
/// (docs/phases.md has both figures, over 60 scenes).
///
/// Free amplitudes: fitted_start is followed as well, to its end, and the lower of the two answers is taken. Annealed
/// starts are at full drive. Where the array is far too strong they end in traps with amplitudes, up to 12 % above.
///
/// others    drives, N per column, there may be none: the phases of the frame before, say
/// options   where the level is free the annealed starts have the level that suits them, and if it is below 1 one at
///           full drive joins them, after five steps; trial, damping and standstill are this function's own
/// returns   the way from the start that won; its first cost is that start's
/// throws    as solve_surface
PhaseSolution search_surface(const SkinProblem& problem, const Eigen::MatrixXcd& others, SurfaceOptions options,
                             const IterationCallback& callback = {});

}  // namespace touchfield
