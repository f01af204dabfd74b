#include "solvers/linear/low_rank.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <stdexcept>

#include <Eigen/QR>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/random_share.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;

/// Entries of length one at random angles, from the generator's bits directly.
MatrixXcd random_block(Index rows, Index columns, std::mt19937_64& generator) {
  MatrixXcd block(rows, columns);
  for (Index j = 0; j < columns; ++j) {
    for (Index i = 0; i < rows; ++i) {
      block(i, j) = std::polar(1.0, 2.0 * std::numbers::pi * random_share(generator));
    }
  }
  return block;
}

MatrixXcd orthonormal(const MatrixXcd& y) {
  const Eigen::HouseholderQR<MatrixXcd> qr(y);
  return qr.householderQ() * MatrixXcd::Identity(y.rows(), y.cols());
}

}  // namespace

LowRank compressed(const MatrixXcd& a, double tolerance, Index block) {
  if (!(tolerance >= 1e-7 && tolerance <= 1.0) || block < 1) {
    throw std::invalid_argument("compressed: the tolerance must be 1e-7 to 1, the block >= 1");
  }
  const double total = a.squaredNorm();
  if (!std::isfinite(total)) {
    throw std::domain_error("compressed: the matrix holds a value that is not finite");
  }
  const Index most = std::min(a.rows(), a.cols());
  LowRank result{MatrixXcd(a.rows(), 0), MatrixXcd(0, a.cols()), total > 0 ? 1.0 : 0.0};
  double left = total;
  std::mt19937_64 generator(1);
  while (left > tolerance * tolerance * total && result.rank() < most) {
    const Index found = result.rank();
    const Index width = std::min(block, most - found);
    MatrixXcd y = matrix_product(a, random_block(a.cols(), width, generator));
    if (found > 0) {
      y -= matrix_product(result.basis, adjoint_product(result.basis, y));
      y = orthonormal(y);  // and once more: near the end of the rank little but rounding was left
      y -= matrix_product(result.basis, adjoint_product(result.basis, y));
    }
    y = orthonormal(y);
    const MatrixXcd rows = adjoint_product(y, a);
    left -= rows.squaredNorm();
    result.basis.conservativeResize(Eigen::NoChange, found + width);
    result.basis.rightCols(width) = y;
    result.coefficients.conservativeResize(found + width, Eigen::NoChange);
    result.coefficients.bottomRows(width) = rows;
  }
  result.left_out = total > 0 ? std::sqrt(std::max(left, 0.0) / total) : 0.0;
  return result;
}

}  // namespace touchfield
