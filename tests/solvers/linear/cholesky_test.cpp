#include <Eigen/Core>
#include <gtest/gtest.h>

#include "solvers/linear/factorisations.h"

namespace touchfield::cholesky_test {

template <typename Scalar>
using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

/// A A^H + 1, condition below a few hundred.
template <typename Scalar>
Matrix<Scalar> positive_matrix(Eigen::Index size) {
  std::srand(7);
  const Matrix<Scalar> a = Matrix<Scalar>::Random(size, size) / std::sqrt(static_cast<float>(size));
  Matrix<Scalar> positive = a * a.adjoint();
  positive.diagonal().array() += Scalar(1);
  return positive;
}

template <typename Scalar>
class Cholesky : public testing::Test {};
using Scalars = testing::Types<float, double, std::complex<double>>;
TYPED_TEST_SUITE(Cholesky, Scalars);

TYPED_TEST(Cholesky, TheFactorTimesItsAdjointIsTheMatrix) {
  constexpr int kSize = 150;  // beyond LAPACK's block
  const Matrix<TypeParam> a = positive_matrix<TypeParam>(kSize);
  Matrix<TypeParam> factor = a;
  factor.template triangularView<Eigen::StrictlyUpper>().setConstant(TypeParam(99));  // must not be read
  ASSERT_TRUE(cholesky_factorise(kSize, factor.data()));
  const Matrix<TypeParam> lower = factor.template triangularView<Eigen::Lower>();
  const auto eps = std::numeric_limits<decltype(a.norm())>::epsilon();
  EXPECT_LT((lower * lower.adjoint() - a).norm(), 10 * kSize * eps * a.norm());
}

TYPED_TEST(Cholesky, AMatrixThatIsNotPositiveIsRefused) {
  Matrix<TypeParam> indefinite = positive_matrix<TypeParam>(40);
  indefinite(20, 20) = TypeParam(-1);
  EXPECT_FALSE(cholesky_factorise(40, indefinite.data()));
}

TYPED_TEST(Cholesky, ANumberThatIsNotFiniteIsRefused) {
  for (const int at : {0, 20, 39}) {
    Matrix<TypeParam> broken = positive_matrix<TypeParam>(40);
    broken(at, at) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(cholesky_factorise(40, broken.data())) << at;
  }
}

TEST(CholeskySolve, SolvesInEachPrecision) {
  const Matrix<double> a = positive_matrix<double>(60);
  const Eigen::VectorXd expected = Eigen::VectorXd::LinSpaced(60, -1.0, 2.0);
  Matrix<double> factor = a;
  Eigen::VectorXd b = a * expected;
  ASSERT_TRUE(cholesky_factorise(60, factor.data()));
  cholesky_solve(60, factor.data(), b.data());
  EXPECT_LT((b - expected).norm(), 1e-13 * expected.norm());  // condition of some hundred times eps

  Matrix<float> single = a.cast<float>();
  Eigen::VectorXf right = (a * expected).cast<float>();
  ASSERT_TRUE(cholesky_factorise(60, single.data()));
  cholesky_solve(60, single.data(), right.data());
  EXPECT_LT((right.cast<double>() - expected).norm(), 1e-4 * expected.norm());
}

}  // namespace touchfield::cholesky_test
