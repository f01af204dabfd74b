#include <random>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "solvers/linear/factorisations.h"
#include "solvers/phase/relaxation.h"

namespace touchfield::dual_factor_test {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXd;

MatrixXcd random_matrix(Index rows, Index cols, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  MatrixXcd matrix(rows, cols);
  for (std::complex<double>& value : matrix.reshaped()) value = {normal(generator), normal(generator)};
  return matrix;
}

VectorXd random_between(Index size, double low, double high, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(low, high);
  return VectorXd::NullaryExpr(size, [&](Index) { return uniform(generator); });
}

struct Example {
  LowRankRelaxation relaxation;
  VectorXd g;
  VectorXd d;

  /// S, as the class documents it.
  MatrixXcd matrix() const {
    const VectorXd weights = level_weights(relaxation.wanted, g);
    const MatrixXcd inner = relaxation.levels * weights.asDiagonal() * relaxation.levels.adjoint() + relaxation.outside;
    MatrixXcd s = relaxation.basis * inner * relaxation.basis.adjoint();
    s.diagonal() -= d.cast<std::complex<double>>();
    return s;
  }
  double least_eigenvalue() const { return hermitian_eigen(matrix()).values(0); }
};

/// Weights 1 - b / g of both signs; `repeated` columns are sums of others.
Example example(Index channels, Index levels, Index others, Index repeated, unsigned seed) {
  MatrixXcd columns = random_matrix(channels, levels + others, seed);
  for (Index i = 0; i < repeated; ++i) {
    columns.col(levels + others - 1 - i) = columns.col(i) - columns.col(i + 1);
  }
  Example result;
  result.relaxation = relaxed(columns, random_between(levels, 0.5, 1.5, seed + 1), 0.0);
  result.g = random_between(levels, 0.7, 3.0, seed + 2);
  result.d = random_between(channels, -3.0, 0.5, seed + 3);
  return result;
}

TEST(Relaxed, HoldsTheColumns) {
  const MatrixXcd columns = random_matrix(40, 13, 1);
  const LowRankRelaxation relaxation = relaxed(columns, VectorXd::Ones(6), 0.0);
  EXPECT_EQ(relaxation.channel_count(), 40);
  EXPECT_EQ(relaxation.level_count(), 6);
  const MatrixXcd& v = relaxation.basis;
  EXPECT_LT((v.adjoint() * v - MatrixXcd::Identity(v.cols(), v.cols())).norm(), 1e-12);
  EXPECT_LT((v * relaxation.levels - columns.leftCols(6)).norm(), 1e-12 * columns.norm());
  EXPECT_LT((v * relaxation.outside * v.adjoint() - columns.rightCols(7) * columns.rightCols(7).adjoint()).norm(),
            1e-12 * columns.squaredNorm());
}

TEST(DualFactor, SolvesWithTheMatrixItself) {
  for (const Index repeated : {0, 3}) {
    const Example e = example(60, 8, 6, repeated, 7);
    const double shift = 0.6 - std::min(0.0, e.least_eigenvalue());  // beyond d, which reaches 0.5
    MatrixXcd full = e.matrix();
    full.diagonal().array() += shift;
    DualFactor factor(e.relaxation);
    factor.weigh(e.g);
    ASSERT_TRUE(factor.factorise(e.d, shift));
    factor.prepare();
    const MatrixXcd sought = random_matrix(5, 60, 11);
    const MatrixXcd x = sought * full;
    MatrixXcd u;
    MatrixXcd z;
    factor.reach(x, u);
    MatrixXcd back = MatrixXcd::Zero(u.rows(), u.cols());
    factor.solve(x, u, back, z);
    EXPECT_LT((z - sought).norm(), 1e-11 * sought.norm()) << repeated;

    const VectorXd diagonal = shift - e.d.array();
    back = random_matrix(u.rows(), u.cols(), 12);
    factor.solve(x, u, back, z);
    const MatrixXcd expected = sought - back * e.relaxation.basis.adjoint() * diagonal.cwiseInverse().asDiagonal();
    EXPECT_LT((z - expected).norm(), 1e-11 * expected.norm()) << repeated;

    const MatrixXcd a = e.relaxation.basis * e.relaxation.levels;  // of the levels, as columns
    const MatrixXcd responses = full.ldlt().solve(a);
    const MatrixXcd short_responses =
        diagonal.cwiseInverse().asDiagonal() * (e.relaxation.basis * factor.level_responses());
    EXPECT_LT((short_responses - responses).norm(), 1e-11 * responses.norm()) << repeated;
    const MatrixXcd mutual = a.adjoint() * responses;
    EXPECT_LT((factor.mutual_responses() - mutual).norm(), 1e-11 * mutual.norm()) << repeated;
  }
}

TEST(DualFactor, FindsTheEdgeOfDefiniteness) {
  for (unsigned seed = 20; seed < 40; ++seed) {
    Example e = example(50, 7, 5, 0, seed);
    e.g *= 0.2;  // most weights negative, or the edge is that of D
    const double edge = -e.least_eigenvalue();
    ASSERT_GT(edge, e.d.maxCoeff() + 1.0);
    DualFactor factor(e.relaxation);
    factor.weigh(e.g);
    EXPECT_TRUE(factor.factorise(e.d, edge + 1e-9)) << seed;
    EXPECT_FALSE(factor.factorise(e.d, edge - 1e-9)) << seed;
    EXPECT_TRUE(factor.factorise(e.d, edge + 1.0)) << seed;  // a failure leaves nothing behind
  }
}

TEST(DualFactor, MovesThePositivePartOfDWhereTheRowsReachAllChannels) {
  Example e = example(12, 20, 15, 0, 41);
  e.g = 2.0 * e.relaxation.wanted;  // weights of 1/2: S is definite well below the largest d
  e.d *= 4.0;
  ASSERT_EQ(e.relaxation.basis.cols(), 12);
  const double edge = -e.least_eigenvalue();
  ASSERT_LT(edge + 0.1, e.d.maxCoeff());
  DualFactor factor(e.relaxation);
  factor.weigh(e.g);
  EXPECT_FALSE(factor.factorise(e.d, edge - 1e-9));
  EXPECT_TRUE(factor.factorise(e.d, std::max(edge, 0.0) + 0.1));
  factor.prepare();
  MatrixXcd full = e.matrix();
  full.diagonal().array() += std::max(edge, 0.0) + 0.1;
  const MatrixXcd sought = random_matrix(3, 12, 42);
  const MatrixXcd x = sought * full;
  MatrixXcd u;
  MatrixXcd z;
  factor.reach(x, u);
  factor.solve(x, u, MatrixXcd::Zero(3, 12), z);
  EXPECT_LT((z - sought).norm(), 1e-10 * sought.norm());
  const MatrixXcd a = e.relaxation.basis * e.relaxation.levels;
  const MatrixXcd mutual = a.adjoint() * full.ldlt().solve(a);
  EXPECT_LT((factor.mutual_responses() - mutual).norm(), 1e-10 * mutual.norm());
}

}  // namespace touchfield::dual_factor_test
