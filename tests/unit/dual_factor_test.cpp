#include "solvers/phase/dual_factor.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "solvers/linear/hermitian_eigen.h"

namespace touchfield {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXd;
using Form = DualFactor::Form;

MatrixXcd random_matrix(Index rows, Index cols, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  MatrixXcd matrix(rows, cols);
  for (std::complex<double>& value : matrix.reshaped()) {
    value = {normal(generator), normal(generator)};
  }
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
};

/// Weights 1 - b / g of both signs; `repeated` columns are sums of others.
Example example(Index channels, Index levels, Index others, Index repeated, unsigned seed) {
  Example result;
  MatrixXcd& columns = result.relaxation.columns;
  columns = random_matrix(channels, levels + others, seed);
  for (Index i = 0; i < repeated; ++i) {
    columns.col(levels + others - 1 - i) = columns.col(i) - columns.col(i + 1);
  }
  result.relaxation.levels = random_between(levels, 0.5, 1.5, seed + 1);
  result.g = random_between(levels, 0.7, 3.0, seed + 2);
  result.d = random_between(channels, -3.0, 0.5, seed + 3);
  return result;
}

double least_eigenvalue(const Example& e) { return hermitian_eigen(dual_matrix(e.relaxation, e.g, e.d)).values(0); }

TEST(DualFactor, BothFormsSolveWithTheMatrixItself) {
  for (const Index repeated : {0, 3}) {
    const Example e = example(60, 8, 6, repeated, 7);
    const double shift = 0.3 - least_eigenvalue(e);
    MatrixXcd full = dual_matrix(e.relaxation, e.g, e.d).selfadjointView<Eigen::Lower>();
    full.diagonal().array() += shift;
    const MatrixXcd sought = random_matrix(5, 60, 11);
    for (const Form form : {Form::dense, Form::reduced}) {
      DualFactor factor(e.relaxation, form);
      factor.weigh(e.g);
      ASSERT_TRUE(factor.factorise(e.d, shift));
      for (int time = 0; time < 2; ++time) {
        MatrixXcd x = sought * full;
        factor.solve_in_place(x);
        EXPECT_LT((x - sought).norm(), 1e-11 * sought.norm()) << repeated << " " << factor.is_reduced();
      }
    }
  }
}

TEST(DualFactor, BothFormsFindTheEdgeOfDefiniteness) {
  for (unsigned seed = 20; seed < 40; ++seed) {
    Example e = example(50, 7, 5, 0, seed);
    e.g *= 0.2;  // most weights negative, or the edge is that of D
    const double edge = -least_eigenvalue(e);
    ASSERT_GT(edge, e.d.maxCoeff() + 1.0);
    for (const Form form : {Form::dense, Form::reduced}) {
      DualFactor factor(e.relaxation, form);
      factor.weigh(e.g);
      EXPECT_TRUE(factor.factorise(e.d, edge + 1e-9)) << seed;
      EXPECT_FALSE(factor.factorise(e.d, edge - 1e-9)) << seed;
      EXPECT_TRUE(factor.factorise(e.d, edge + 1.0)) << seed;  // a failure leaves nothing behind
    }
  }
}

TEST(DualFactor, ReducedRefusesADiagonalThatIsNotPositive) {
  const Example e = example(30, 4, 3, 0, 3);
  DualFactor factor(e.relaxation, Form::reduced);
  factor.weigh(e.g);
  EXPECT_FALSE(factor.factorise(e.d, e.d.maxCoeff()));
  EXPECT_FALSE(factor.factorise(e.d, std::nan("")));
}

TEST(DualFactor, ChoosesTheReducedFormWhereColumnsAreFew) {
  EXPECT_TRUE(DualFactor(example(60, 8, 6, 0, 1).relaxation).is_reduced());
  EXPECT_FALSE(DualFactor(example(20, 8, 6, 0, 1).relaxation).is_reduced());
}

TEST(DualFactor, WithoutAnyLevelOrColumnOnlyTheDiagonalRemains) {
  Example e = example(10, 1, 0, 0, 5);
  e.relaxation.columns.setZero();
  for (const Form form : {Form::dense, Form::reduced}) {
    DualFactor factor(e.relaxation, form);
    factor.weigh(e.g);
    ASSERT_TRUE(factor.factorise(e.d, 1.0));
    MatrixXcd x = MatrixXcd::Ones(1, 10);
    factor.solve_in_place(x);
    EXPECT_LT((x.transpose().real() - (1.0 - e.d.array()).inverse().matrix()).norm(), 1e-13);
  }
}

}  // namespace
}  // namespace touchfield
