#pragma once

#include <vector>

#include "sim/gpu/cuda/column_block.cuh"

namespace touchfield::cuda {

struct RefinementLimits {
  double tolerance = 1e-5;  ///< relative residual ||b - A x|| / ||b|| a column is to reach, > 0
  int max_rounds = 10;      ///< corrections at most after the first x, >= 0
};

struct RefinementReport {
  int rounds = 0;                 ///< corrections made after the first x, which is C b or the start
  double worst = 0.0;             ///< of residuals
  std::vector<double> residuals;  ///< of each column: ||b - A x|| / ||b|| by the exact product
  bool converged = false;         ///< every column has reached the tolerance
};

/// Iterative refinement by the rules of touchfield::refine (solvers/linear/refinement.h): x = C b or a given start, then
/// x <- x + C (b - A x) for the columns above the tolerance, until max_rounds or a round that does not halve the worst
/// residual; each column then has the best of its iterates.
///
/// exact                 A X in the precision that the residuals are to have
/// approximate_inverse   C X; gets columns of unit norm
/// b, x                  n x S on the card, column by column without gaps, not overlapping
/// memory                3 n S complex numbers of single precision, kept for the next solve
/// throws                std::domain_error if b, a correction or a product holds a value that is not finite,
///                       std::invalid_argument for limits out of range, GpuMemoryFailure
class BlockRefinement {
 public:
  explicit BlockRefinement(Context& context);

  RefinementReport solve(const BlockProduct& exact, const BlockProduct& approximate_inverse, int n, int columns,
                         const cuComplex* b, cuComplex* x, const RefinementLimits& limits, bool x_is_start);

 private:
  ColumnBlock block_;
  Array<cuComplex> directions_;  // residuals, scaled to unit norm
  Array<cuComplex> correction_;  // then the product
  Array<cuComplex> candidate_;
};

}  // namespace touchfield::cuda
