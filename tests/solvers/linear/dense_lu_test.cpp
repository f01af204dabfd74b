#include <stdexcept>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "solvers/linear/factorisations.h"
#include "tests/support/linear_support.h"

namespace touchfield::dense_lu_test {

// Backward stable: residuals of a few hundred roundings of a well-conditioned 60 x 60 system.
constexpr double kRounding = 1e-12;
constexpr float kSingleRounding = 1e-4F;

TEST(DenseLu, SolvesBlocksOfRightHandSides) {
  const Eigen::MatrixXcd a = random_matrix(60, 60, 1) + 4.0 * Eigen::MatrixXcd::Identity(60, 60);
  const Eigen::MatrixXcd b = random_matrix(60, 5, 2);
  EXPECT_LT((a * DenseLu(a).solve(b) - b).norm(), kRounding * b.norm());
}

TEST(DenseLu, TransposeIsNotTheAdjoint) {
  const Eigen::MatrixXcd a = random_matrix(60, 60, 3) + 4.0 * Eigen::MatrixXcd::Identity(60, 60);
  const Eigen::MatrixXcd b = random_matrix(60, 2, 4);
  const Eigen::MatrixXcd x = DenseLu(a).solve_transpose(b);
  EXPECT_LT((a.transpose() * x - b).norm(), kRounding * b.norm());
  EXPECT_GT((a.adjoint() * x - b).norm(), 1e-2 * b.norm());
}

TEST(DenseLu, ConditionEstimateIsWithinTheTrueOne) {
  const Eigen::MatrixXcd a = random_matrix(40, 40, 5);
  const double norm = a.cwiseAbs().colwise().sum().maxCoeff();
  const double inverse_norm = a.inverse().cwiseAbs().colwise().sum().maxCoeff();
  const double exact = 1.0 / (norm * inverse_norm);
  // The estimator bounds the norm of the inverse from below and is rarely off by more than 3.
  EXPECT_GE(DenseLu(a).reciprocal_condition(), exact * (1.0 - 1e-10));
  EXPECT_LE(DenseLu(a).reciprocal_condition(), 3.0 * exact);
}

TEST(DenseLu, RefusesWhatHasNoSolution) {
  Eigen::MatrixXcd singular = random_matrix(10, 10, 6);
  singular.col(4).setZero();
  EXPECT_THROW(DenseLu{singular}, std::domain_error);
  Eigen::MatrixXcd nan = Eigen::MatrixXcd::Identity(4, 4);
  nan(1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(DenseLu{nan}, std::domain_error);
  EXPECT_THROW(DenseLu{Eigen::MatrixXcd::Zero(3, 4)}, std::invalid_argument);
  EXPECT_THROW(DenseLu{Eigen::MatrixXcd::Identity(3, 3)}.solve(Eigen::MatrixXcd::Zero(4, 1)), std::invalid_argument);
}

TEST(DenseLu, SingleSolvesToSinglePrecision) {
  const Eigen::MatrixXcf a =
      (random_matrix(60, 60, 7) + 4.0 * Eigen::MatrixXcd::Identity(60, 60)).cast<std::complex<float>>();
  const Eigen::MatrixXcf b = random_matrix(60, 5, 8).cast<std::complex<float>>();
  const DenseLuSingle lu(a);
  EXPECT_LT((a * lu.solve(b) - b).norm(), kSingleRounding * b.norm());
  EXPECT_LT((a.transpose() * lu.solve_transpose(b) - b).norm(), kSingleRounding * b.norm());
}

TEST(DenseLu, SingleRefusesWhatIsNotFinite) {
  Eigen::MatrixXcf singular = Eigen::MatrixXcf::Identity(5, 5);
  singular(2, 2) = 0.0F;
  EXPECT_THROW(DenseLuSingle{singular}, std::domain_error);
  for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Eigen::MatrixXcf a = Eigen::MatrixXcf::Identity(5, 5);
    a(3, 1) = std::complex<float>(0.0F, value);
    EXPECT_THROW(DenseLuSingle{a}, std::domain_error);
  }
}

// The values add up to 6e38, beyond what a float holds; none of them is.
TEST(DenseLu, LargeFiniteValuesAreNotTakenForInfinite) {
  Eigen::MatrixXcf a = Eigen::MatrixXcf::Zero(2, 2);
  a(0, 0) = 3e38F;
  a(1, 1) = 3e38F;
  const Eigen::MatrixXcf x = DenseLuSingle(a).solve(3e38F * Eigen::MatrixXcf::Ones(2, 1));
  EXPECT_LT((x - Eigen::MatrixXcf::Ones(2, 1)).norm(), kSingleRounding);
}

}  // namespace touchfield::dense_lu_test
