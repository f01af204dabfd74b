#pragma once

#include "solvers/phase/skin_problem.h"

namespace touchfield {

struct AnnealingOptions {
  int width = 2;       // l, 2 to 8
  int descent = 24;    // steps with rows of any direction, >= 1
  int stage = 4;       // steps at each of the eight bounds, >= 1
  double level = 1.0;  // amplitude of all drives, > 0
  unsigned seed = 1;
};

/// Drives of amplitude `level` to start from, by way of a problem with fewer traps. Every drive is a row of l numbers
/// of length `level` together, Y is N x l, and
///
///   F(Y) = sum_j w_j (|h_j Y| - p'_j)^2 + || R Y ||^2
///
/// as in low_rank_relaxation.h. From random rows F falls by accelerated projected gradient steps. Their length is 1 /
/// ||A||^2 at first, A = [diag(sqrt w) H_T; R]. Then Y is turned so that its first column is the strongest. What is
/// left in the others is bounded more tightly in each stage, while F continues falling:
///
///   sqrt(sum_i>1 |y_ni|^2) <= 0.8 level, 0.65 level, ... 0
///
/// cost      one pass over A in single precision per step; the result is the same to the last bit for every number of
///           threads. Channels in another order have other rows, and may end in another trap
/// throws    std::invalid_argument as require_valid, on options out of range
/// source    Nesterov's acceleration with restarts: O'Donoghue and Candes, Found. Comput. Math. 15 (2015) 715
Eigen::VectorXcd annealed_start(const SkinProblem& problem, const AnnealingOptions& options = {});

/// Annealed starts worth following, and the level for them.
struct AnnealedStarts {
  Eigen::MatrixXcd drives;   // N x 2: of five those of the lowest cost, the lowest first
  Eigen::VectorXcd at_full;  // the first of the five at level 1
  double level = 1.0;        // of `drives`: 1 but where the array is far too strong for what is wanted
};

/// Five of them: on problems with traps they end in different ones, and their costs tell early which is low. Together
/// they cost about as much as 15 steps of solve_surface.
///
/// free_level   whether the level may be below 1: found to a tenth by annealing again and again at the level that was
///              best, and taken if it is below 0.5
AnnealedStarts annealed_starts(const SkinProblem& problem, bool free_level);

}  // namespace touchfield
