#pragma once

#include <Eigen/Core>

namespace touchfield {

/// A matrix by fewer columns: A = basis coefficients + E.
struct LowRank {
  Eigen::MatrixXcd basis;         ///< n x r, orthonormal columns
  Eigen::MatrixXcd coefficients;  ///< r x s, basis^H A
  double left_out = 0.0;          ///< ||E||_F / ||A||_F

  Eigen::Index rank() const { return basis.cols(); }
};

/// Finds the range of A by products with random blocks, each made orthogonal to what is found, until no more than the
/// tolerance is left out. Costs two products of A with r columns.
///
/// a           n x s, finite
/// tolerance   on ||E||_F / ||A||_F, 1e-7 to 1
/// returns     rank min(n, s) at most, some `block` columns more than the least that would do; 0 for a zero matrix.
///             The same for every number of threads, to rounding
/// throws      std::invalid_argument on a tolerance out of range; std::domain_error on a value that is not finite
/// source      Halko, Martinsson and Tropp, SIAM Review 53 (2011) 217, algorithm 4.2 in blocks
LowRank compressed(const Eigen::MatrixXcd& a, double tolerance, Eigen::Index block = 64);

}  // namespace touchfield
