#include <stdexcept>

#include <Eigen/QR>

#include "solvers/linear/factorisations.h"
#include "tests/support/linear_support.h"
#include "tests/support/testing.h"

namespace touchfield::refinement_test {

Eigen::MatrixXcd random_unitary(Eigen::Index n, unsigned seed) {
  return Eigen::HouseholderQR<Eigen::MatrixXcd>(random_matrix(n, n, seed)).householderQ();
}

Product solve_with(const DenseLuSingle& lu) {
  return [&lu](const Eigen::MatrixXcd& x) -> Eigen::MatrixXcd {
    return lu.solve(x.cast<std::complex<float>>()).cast<std::complex<double>>();
  };
}

double relative_residual(const Eigen::MatrixXcd& a, const Eigen::VectorXcd& x, const Eigen::VectorXcd& b) {
  return (a * x - b).norm() / b.norm();
}

// Single precision has 1e-7 and each round gains about as much again.
TEST(Refinement, SinglePrecisionLuReachesDoublePrecision) {
  const Eigen::MatrixXcd a = random_matrix(100, 100, 1) + 15.0 * Eigen::MatrixXcd::Identity(100, 100);
  const Eigen::MatrixXcd b = random_matrix(100, 4, 2);
  const DenseLuSingle lu(a.cast<std::complex<float>>());
  const RefinementResult first = refine(product_with(a), solve_with(lu), b, {.tolerance = 1e-12, .max_rounds = 0});
  EXPECT_FALSE(first.converged);
  EXPECT_EQ(first.rounds, 0);
  EXPECT_GT(first.residuals[0], 1e-9);
  EXPECT_LT(first.residuals[0], 1e-4);
  const RefinementResult result = refine(product_with(a), solve_with(lu), b, {.tolerance = 1e-12});
  EXPECT_TRUE(result.converged);
  EXPECT_GE(result.rounds, 1);
  EXPECT_LE(result.rounds, 3);
  EXPECT_THAT(result.residuals, Each(Le(1e-12)));
  for (Eigen::Index s = 0; s < b.cols(); ++s) {
    EXPECT_NEAR(relative_residual(a, result.x.col(s), b.col(s)), result.residuals[static_cast<std::size_t>(s)], 1e-14);
  }
}

// At a condition of 1e9 the single-precision factors, off by 6e-8 of the norm, are no approximate inverse. For images
// of moderate vectors the first solution still has the small residual of a backward stable one, which a correction
// may spoil (rounding decides); for a random right-hand side it is worse than none.
TEST(Refinement, BadlyConditionedMatrixIsReportedAndTheBetterIterateKept) {
  constexpr Eigen::Index kSize = 80;
  Eigen::VectorXcd singular_values(kSize);
  for (Eigen::Index i = 0; i < kSize; ++i) {
    singular_values(i) = std::pow(10.0, -9.0 * static_cast<double>(i) / static_cast<double>(kSize - 1));
  }
  const Eigen::MatrixXcd a = random_unitary(kSize, 3) * singular_values.asDiagonal() * random_unitary(kSize, 4);
  Eigen::MatrixXcd b = a * random_matrix(kSize, 3, 5);
  b.col(2) = random_matrix(kSize, 1, 6);
  const DenseLuSingle lu(a.cast<std::complex<float>>());
  std::vector<Eigen::MatrixXcd> tried;
  const Product exact = [&](const Eigen::MatrixXcd& x) -> Eigen::MatrixXcd {
    tried.push_back(x);
    return a * x;
  };
  const RefinementResult result = refine(exact, solve_with(lu), b, {});
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.rounds, 1);
  ASSERT_EQ(tried.size(), 2U);
  for (Eigen::Index s = 0; s < 2; ++s) {
    const double better =
        std::min(relative_residual(a, tried[0].col(s), b.col(s)), relative_residual(a, tried[1].col(s), b.col(s)));
    EXPECT_LT(better, 1e-4);
    EXPECT_NEAR(result.residuals[static_cast<std::size_t>(s)], better, 1e-12);
    EXPECT_NEAR(relative_residual(a, result.x.col(s), b.col(s)), better, 1e-12);
  }
  ASSERT_GT(relative_residual(a, tried[0].col(2), b.col(2)), 1.0);
  EXPECT_EQ(result.x.col(2).norm(), 0.0);
  EXPECT_EQ(result.residuals[2], 1.0);
}

// An inverse that is off by the factor 1 + e leaves the share |e| a round: 0.25 converges, 0.75 is too slow, and 3
// diverges from the first solution on.
TEST(Refinement, RateFollowsTheInverse) {
  const Eigen::MatrixXcd b = random_matrix(10, 1, 6);
  const Product identity = [](const Eigen::MatrixXcd& x) { return x; };
  const auto scaled = [](double factor) -> Product {
    return [factor](const Eigen::MatrixXcd& x) -> Eigen::MatrixXcd { return factor * x; };
  };
  const RefinementResult fast = refine(identity, scaled(1.25), b, {.tolerance = 2e-3});
  EXPECT_TRUE(fast.converged);
  EXPECT_EQ(fast.rounds, 4);  // 0.25^5 < 2e-3 < 0.25^4
  EXPECT_NEAR(fast.residuals[0], std::pow(0.25, 5), 1e-14);
  const RefinementResult slow = refine(identity, scaled(1.75), b, {});
  EXPECT_FALSE(slow.converged);
  EXPECT_EQ(slow.rounds, 1);
  EXPECT_NEAR(slow.residuals[0], std::pow(0.75, 2), 1e-14);
  const RefinementResult diverging = refine(identity, scaled(4.0), b, {});
  EXPECT_FALSE(diverging.converged);
  EXPECT_EQ(diverging.x.norm(), 0.0);
  EXPECT_EQ(diverging.residuals[0], 1.0);
}

// 1e-44 and its residuals are out of single precision's range, columns scaled to unit norm are not.
TEST(Refinement, SmallRightHandSidesDoNotUnderflow) {
  const Eigen::MatrixXcd a = random_matrix(30, 30, 7) + 10.0 * Eigen::MatrixXcd::Identity(30, 30);
  const DenseLuSingle lu(a.cast<std::complex<float>>());
  const Eigen::MatrixXcd b = 1e-44 * random_matrix(30, 2, 8);
  EXPECT_TRUE(refine(product_with(a), solve_with(lu), b, {.tolerance = 1e-12}).converged);
}

TEST(Refinement, RefusesWhatIsNotFiniteAndOtherShapes) {
  const Product identity = [](const Eigen::MatrixXcd& x) { return x; };
  const Product nan = [](const Eigen::MatrixXcd& x) -> Eigen::MatrixXcd {
    return std::numeric_limits<double>::quiet_NaN() * x;
  };
  const Product short_one = [](const Eigen::MatrixXcd& x) -> Eigen::MatrixXcd { return x.topRows(1); };
  const Eigen::MatrixXcd b = Eigen::MatrixXcd::Ones(3, 1);
  EXPECT_THROW(refine(nan, identity, b, {}), std::domain_error);
  EXPECT_THROW(refine(identity, nan, b, {}), std::domain_error);
  EXPECT_THROW(refine(identity, identity, std::numeric_limits<double>::infinity() * b, {}), std::domain_error);
  EXPECT_THROW(refine(short_one, identity, b, {}), std::invalid_argument);
  EXPECT_THROW(refine(identity, short_one, b, {}), std::invalid_argument);
  EXPECT_THROW(refine(identity, identity, b, {.tolerance = 0.0}), std::invalid_argument);
  EXPECT_THROW(refine(identity, identity, b, {.max_rounds = -1}), std::invalid_argument);
}

}  // namespace touchfield::refinement_test
