#include "solvers/linear/low_rank.h"

#include <stdexcept>

#include <Eigen/QR>
#include <gtest/gtest.h>

namespace touchfield::low_rank_test {

using Eigen::Index;
using Eigen::MatrixXcd;

MatrixXcd random_unitary_columns(Index rows, Index columns, unsigned seed) {
  std::srand(seed);
  const Eigen::HouseholderQR<MatrixXcd> qr(MatrixXcd::Random(rows, columns));
  return qr.householderQ() * MatrixXcd::Identity(rows, columns);
}

/// A matrix with the given singular values.
MatrixXcd with_singular_values(Index rows, Index columns, const Eigen::VectorXd& values) {
  return random_unitary_columns(rows, values.size(), 1) * values.cast<std::complex<double>>().asDiagonal() *
         random_unitary_columns(columns, values.size(), 2).adjoint();
}

Eigen::VectorXd geometric(Index count, double ratio) {
  Eigen::VectorXd values(count);
  for (Index i = 0; i < count; ++i) values(i) = std::pow(ratio, static_cast<double>(i));
  return values;
}

TEST(LowRank, LeavesOutWhatItSays) {
  const MatrixXcd a = with_singular_values(300, 200, geometric(200, 0.8));
  for (const double tolerance : {0.5, 1e-2, 1e-4, 1e-6}) {
    const LowRank low = compressed(a, tolerance, 8);
    const double left = (a - low.basis * low.coefficients).norm() / a.norm();
    EXPECT_LE(left, tolerance);
    // Rounding of the squared norms: some 1e-15, 3e-8 in the norm.
    EXPECT_NEAR(low.left_out, left, 1e-7 + 1e-6 * left);
    EXPECT_LT((low.basis.adjoint() * low.basis - MatrixXcd::Identity(low.rank(), low.rank())).norm(), 1e-12);
    // The least rank r leaves out 0.8^r; random blocks of 8 take at most some blocks more.
    const double least = std::log(tolerance) / std::log(0.8);
    EXPECT_GE(static_cast<double>(low.rank()), std::floor(least));
    EXPECT_LE(static_cast<double>(low.rank()), least + 24);
  }
}

TEST(LowRank, FullRankEndsWithAllColumns) {
  const MatrixXcd a = with_singular_values(50, 70, Eigen::VectorXd::Ones(50));
  const LowRank low = compressed(a, 1e-7, 16);
  EXPECT_EQ(low.rank(), 50);
  EXPECT_LT((a - low.basis * low.coefficients).norm(), 1e-12 * a.norm());
}

TEST(LowRank, RefusesWhatItCannotMeasure) {
  EXPECT_THROW(compressed(MatrixXcd::Ones(3, 3), 1e-9), std::invalid_argument);
  EXPECT_THROW(compressed(MatrixXcd::Ones(3, 3), std::nan("")), std::invalid_argument);
  MatrixXcd a = MatrixXcd::Ones(3, 3);
  a(1, 1) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(compressed(a, 1e-3), std::domain_error);
}

}  // namespace touchfield::low_rank_test
