#include <stdexcept>

#include <gtest/gtest.h>

#include "solvers/linear/factorisations.h"

namespace touchfield::hermitian_eigen_test {

using Eigen::MatrixXcd;

TEST(HermitianEigen, TakesAMatrixApart) {
  std::srand(3);
  const MatrixXcd half = MatrixXcd::Random(60, 60);
  const MatrixXcd a = half + half.adjoint();
  MatrixXcd lower = a;
  lower.triangularView<Eigen::StrictlyUpper>().setConstant(std::numeric_limits<double>::quiet_NaN());  // not read
  const HermitianEigen eigen = hermitian_eigen(lower);
  // 60 eps ||A|| is 2e-13 for a norm of about 15.
  EXPECT_LT((eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.adjoint() - a).norm(), 1e-12 * a.norm());
  EXPECT_LT((eigen.vectors.adjoint() * eigen.vectors - MatrixXcd::Identity(60, 60)).norm(), 1e-12);
  for (Eigen::Index i = 1; i < 60; ++i) EXPECT_LE(eigen.values(i - 1), eigen.values(i));
  EXPECT_NEAR(eigen.values.sum(), a.trace().real(), 1e-11);
}

TEST(HermitianEigen, RefusesWhatIsNone) {
  EXPECT_THROW(hermitian_eigen(MatrixXcd::Zero(2, 3)), std::invalid_argument);
  MatrixXcd a = MatrixXcd::Identity(2, 2);
  a(1, 0) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(hermitian_eigen(a), std::domain_error);
  EXPECT_EQ(hermitian_eigen(MatrixXcd(0, 0)).values.size(), 0);
}

}  // namespace touchfield::hermitian_eigen_test
