#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/linear/linear_operator.h"

namespace touchfield {

struct RefinementOptions {
  double tolerance = 1e-10;  ///< relative residual ||b - A x|| / ||b|| a column is to reach, > 0
  int max_rounds = 10;       ///< corrections at most, >= 0
};

struct RefinementResult {
  Eigen::MatrixXcd x;             ///< n x S
  std::vector<double> residuals;  ///< of each column: ||b - A x|| / ||b|| by the exact product
  int rounds = 0;                 ///< corrections made after the first solution
  bool converged = false;         ///< every column has reached the tolerance
};

/// Iterative refinement: x = C b, then x <- x + C (b - A x) for the columns above the tolerance, C being close to A^-1.
/// It stops early after max_rounds or when a round does not halve the worst residual. `converged` is false if a column
/// is then still above the tolerance. Each column has the best of its iterates, x = 0 among them.
///
/// exact                 A X in the precision the residuals are to have
/// approximate_inverse   C X; gets columns of unit norm, so that in single precision no small residual underflows
/// b                     n x S, finite
/// throws                std::domain_error if b, a correction or a product holds a value that is not finite,
///                       std::invalid_argument for options out of range or a product of another shape
/// source                Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., ch. 12
RefinementResult refine(const Product& exact, const Product& approximate_inverse, const Eigen::MatrixXcd& b,
                        const RefinementOptions& options);

}  // namespace touchfield
