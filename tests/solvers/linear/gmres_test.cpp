#include "solvers/linear/gmres.h"

#include <stdexcept>

#include <Eigen/LU>

#include "solvers/linear/factorisations.h"
#include "tests/support/linear_support.h"
#include "tests/support/testing.h"

namespace touchfield::gmres_test {

/// Eigenvalues spread over a disc of the given radius around 1.
Eigen::MatrixXcd near_identity(Eigen::Index n, double radius, unsigned seed) {
  // The entries have mean square 2/3, so the random part has the spectral radius sqrt(2 n / 3).
  return Eigen::MatrixXcd::Identity(n, n) +
         radius / std::sqrt(2.0 * static_cast<double>(n) / 3.0) * random_matrix(n, n, seed);
}

TEST(Gmres, MeetsTheToleranceAndAgreesWithLu) {
  const Eigen::MatrixXcd a = near_identity(120, 0.7, 1);
  const Eigen::MatrixXcd b = random_matrix(120, 4, 2);
  for (const double tolerance : {1e-3, 1e-6, 1e-12}) {
    const GmresResult result = gmres(product_with(a), b, {.tolerance = tolerance});
    EXPECT_TRUE(result.converged);
    EXPECT_THAT(result.residuals, Each(Le(tolerance)));
    // The residual of the result is the reported one; the error is at most ||A^-1|| times larger.
    EXPECT_NEAR(worst_residual(a * result.x, b), *std::ranges::max_element(result.residuals), 1e-14);
    const Eigen::MatrixXcd exact = DenseLu(a).solve(b);
    const double inverse_norm = DenseLu(a).solve(Eigen::MatrixXcd::Identity(120, 120)).norm();
    EXPECT_LE((result.x - exact).norm(), inverse_norm * tolerance * b.norm());
  }
}

TEST(Gmres, BlockEqualsColumnByColumn) {
  const Eigen::MatrixXcd a = near_identity(80, 0.8, 5);
  Eigen::MatrixXcd b = random_matrix(80, 5, 6);
  b.col(1) *= 1e6;  // the residual is relative to each column
  b.col(3) *= 1e-6;
  b.col(2) = a * Eigen::MatrixXcd::Ones(80, 1);
  const GmresOptions options{.tolerance = 1e-9, .restart = 12};
  const GmresResult block = gmres(product_with(a), b, options);
  int columns = 0;
  for (Eigen::Index s = 0; s < b.cols(); ++s) {
    const GmresResult single = gmres(product_with(a), b.col(s), options);
    EXPECT_EQ(block.steps[static_cast<std::size_t>(s)], single.steps[0]);
    EXPECT_LT((block.x.col(s) - single.x).norm(), 1e-12 * single.x.norm());
    columns += single.columns;
  }
  EXPECT_EQ(block.columns, columns);  // no column is multiplied after it has converged
}

TEST(Gmres, ARightPreconditionerSavesStepsAndChangesNothingElse) {
  const Eigen::MatrixXcd a = near_identity(120, 0.9, 1);
  const Eigen::MatrixXcd near = (a + 0.01 * random_matrix(120, 120, 3)).inverse();
  const Eigen::MatrixXcd b = random_matrix(120, 2, 2);
  const GmresResult plain = gmres(product_with(a), b, {1e-10, 200, 100});
  for (const int restart : {100, 3}) {
    const GmresResult result = gmres(product_with(a), b, {1e-10, 200, restart}, {}, product_with(near));
    EXPECT_TRUE(result.converged);
    EXPECT_LT(result.steps[0], plain.steps[0] / 2);
    for (Eigen::Index s = 0; s < 2; ++s) {
      const double residual = (a * result.x.col(s) - b.col(s)).norm() / b.col(s).norm();
      EXPECT_NEAR(residual, result.residuals[static_cast<std::size_t>(s)], 1e-12);
      EXPECT_LE(residual, 1e-10);
    }
  }
}

TEST(Gmres, ZeroColumnIsSolvedByZeroInNoStep) {
  const Eigen::MatrixXcd a = near_identity(20, 0.5, 13);
  Eigen::MatrixXcd b = random_matrix(20, 3, 14);
  b.col(1).setZero();
  const GmresResult result = gmres(product_with(a), b, {});
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.x.col(1).norm(), 0.0);
  EXPECT_EQ(result.steps[1], 0);
  EXPECT_EQ(result.residuals[1], 0.0);
  EXPECT_LE(worst_residual(a * result.x(Eigen::all, {0, 2}), b(Eigen::all, {0, 2})), 1e-6);

  const GmresResult nothing = gmres(product_with(a), Eigen::MatrixXcd::Zero(20, 2), {});
  EXPECT_TRUE(nothing.converged);
  EXPECT_EQ(nothing.products, 0);
  EXPECT_TRUE(gmres(product_with(a), Eigen::MatrixXcd(20, 0), {}).converged);
}

// The residual of a cyclic shift stays 1 until the space is the whole one: no restart below n ever moves.
TEST(Gmres, StagnationIsAStatus) {
  constexpr Eigen::Index kSize = 20;
  const Product shift = [](const Eigen::MatrixXcd& x) {
    Eigen::MatrixXcd y(x.rows(), x.cols());
    y.bottomRows(x.rows() - 1) = x.topRows(x.rows() - 1);
    y.row(0) = x.row(x.rows() - 1);
    return y;
  };
  const Eigen::MatrixXcd b = Eigen::MatrixXcd::Identity(kSize, 1);
  const GmresResult stagnated = gmres(shift, b, {.restart = 5});
  EXPECT_FALSE(stagnated.converged);
  EXPECT_THAT(stagnated.steps, ElementsAre(5));
  EXPECT_EQ(stagnated.residuals[0], 1.0);
  const GmresResult full = gmres(shift, b, {.restart = 60});
  EXPECT_TRUE(full.converged);
  EXPECT_THAT(full.steps, ElementsAre(kSize));
}

// diag(0, 1, 1, ..) with b = 1: the first entry of the residual stays 1, the others vanish.
TEST(Gmres, SingularMatrixGivesTheLeastResidual) {
  constexpr Eigen::Index kSize = 9;
  Eigen::MatrixXcd a = Eigen::MatrixXcd::Identity(kSize, kSize);
  a(0, 0) = 0.0;
  const GmresResult result = gmres(product_with(a), Eigen::MatrixXcd::Ones(kSize, 1), {});
  EXPECT_FALSE(result.converged);
  EXPECT_NEAR(result.residuals[0], 1.0 / 3.0, 1e-14);
  EXPECT_TRUE(result.x.allFinite());
  EXPECT_LT(result.steps[0], 10);

  const GmresResult none = gmres(product_with(Eigen::MatrixXcd::Zero(4, 4)), Eigen::MatrixXcd::Ones(4, 1), {});
  EXPECT_FALSE(none.converged);
  EXPECT_EQ(none.x.norm(), 0.0);
  EXPECT_EQ(none.residuals[0], 1.0);
}

// The first products are off by 1e-4, so the estimate, not the truth, is in tolerance after the first cycle.
TEST(Gmres, GoesOnWhereTheEstimateWasTooGood) {
  const Eigen::MatrixXcd a = near_identity(60, 0.5, 15);
  const Eigen::MatrixXcd off = a + 1e-4 * near_identity(60, 0.5, 16);
  const Eigen::MatrixXcd b = random_matrix(60, 2, 17);
  const int estimated = gmres(product_with(off), b, {.tolerance = 1e-9}).steps[0];
  int calls = 0;
  const Product improving = [&](const Eigen::MatrixXcd& x) -> Eigen::MatrixXcd {
    return (++calls <= estimated ? off : a) * x;
  };
  const GmresResult result = gmres(improving, b, {.tolerance = 1e-9});
  EXPECT_TRUE(result.converged);
  EXPECT_GT(result.steps[0], estimated);
  EXPECT_LE(worst_residual(a * result.x, b), 1e-9);
}

TEST(Gmres, ToleranceBelowRoundingEndsWithTheBestThereIs) {
  const Eigen::MatrixXcd a = near_identity(60, 0.5, 18);
  const GmresResult result = gmres(product_with(a), random_matrix(60, 2, 19), {.tolerance = 1e-18, .max_steps = 1000});
  EXPECT_FALSE(result.converged);
  EXPECT_THAT(result.residuals, Each(Lt(1e-14)));
  EXPECT_THAT(result.steps, Each(Lt(1000)));
}

TEST(Gmres, StopsAtTheMostSteps) {
  const Eigen::MatrixXcd a = near_identity(60, 0.9, 20);
  const Eigen::MatrixXcd b = random_matrix(60, 2, 21);
  const GmresResult result = gmres(product_with(a), b, {.tolerance = 1e-12, .max_steps = 7, .restart = 3});
  EXPECT_FALSE(result.converged);
  EXPECT_THAT(result.steps, ElementsAre(7, 7));
  EXPECT_NEAR(worst_residual(a * result.x, b), *std::ranges::max_element(result.residuals), 1e-14);
  const GmresResult none = gmres(product_with(a), b, {.max_steps = 0});
  EXPECT_FALSE(none.converged);
  EXPECT_EQ(none.products, 0);
  EXPECT_THAT(none.residuals, ElementsAre(1.0, 1.0));
}

TEST(Gmres, ColumnsOfAnyScale) {
  const Eigen::MatrixXcd a = near_identity(30, 0.5, 24);
  Eigen::MatrixXcd b = random_matrix(30, 3, 25);
  const GmresResult plain = gmres(product_with(a), b, {});
  b.col(0) *= 1e-200;  // its squares underflow
  b.col(2) *= 1e200;
  const GmresResult scaled = gmres(product_with(a), b, {});
  EXPECT_TRUE(scaled.converged);
  EXPECT_EQ(scaled.steps, plain.steps);
  EXPECT_LT((scaled.x.col(0) * 1e200 - plain.x.col(0)).norm(), 1e-13 * plain.x.col(0).norm());
  EXPECT_LT((scaled.x.col(2) * 1e-200 - plain.x.col(2)).norm(), 1e-13 * plain.x.col(2).norm());
}

TEST(Gmres, NamesWhatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Eigen::MatrixXcd a = near_identity(20, 0.5, 26);
  Eigen::MatrixXcd b = random_matrix(20, 2, 27);
  int calls = 0;
  const Product failing = [&](const Eigen::MatrixXcd& x) {
    Eigen::MatrixXcd y = a * x;
    if (++calls == 3) y(5, 1) = std::complex<double>(0.0, nan);
    return y;
  };
  EXPECT_THAT(message_of<std::domain_error>([&] { gmres(failing, b, {}); }), HasSubstr("product 3"));
  b(3, 1) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(message_of<std::domain_error>([&] { gmres(product_with(a), b, {}); }), HasSubstr("right-hand side 1"));
}

}  // namespace touchfield::gmres_test
