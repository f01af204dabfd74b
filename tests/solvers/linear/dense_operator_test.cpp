#include <stdexcept>

#include <gtest/gtest.h>

#include "solvers/linear/linear_operator.h"
#include "tests/support/linear_support.h"

namespace touchfield::dense_operator_test {

template <typename Real>
class DenseOperatorTest : public testing::Test {
 protected:
  using Matrix = typename DenseOperator<Real>::Matrix;

  static constexpr Eigen::Index kSize = 70;
  // A sum of 70 products, each rounded once or twice.
  static constexpr double kRounding = 70.0 * std::numeric_limits<Real>::epsilon();

  const Matrix matrix_ = random_matrix(kSize, kSize, 1).template cast<std::complex<Real>>();
  const Eigen::MatrixXcd exact_ = matrix_.template cast<std::complex<double>>();
  const DenseOperator<Real> operator_{matrix_};
};

using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(DenseOperatorTest, Reals);

// One, two and more columns take different ways through BLAS.
TYPED_TEST(DenseOperatorTest, MultipliesBlocks) {
  for (const Eigen::Index columns : {1, 2, 3, 9}) {
    const Eigen::MatrixXcd x = random_matrix(this->kSize, columns, 2);
    const double allowed = this->kRounding * this->exact_.norm() * x.norm();
    EXPECT_LT((this->operator_.apply(x) - this->exact_ * x).norm(), allowed) << columns;
    EXPECT_LT((this->operator_.apply_transpose(x) - this->exact_.transpose() * x).norm(), allowed) << columns;
  }
}

TYPED_TEST(DenseOperatorTest, HandlesEmptyBlocksAndOneUnknown) {
  EXPECT_EQ(this->operator_.apply(Eigen::MatrixXcd(this->kSize, 0)).rows(), this->kSize);
  const DenseOperator<TypeParam> none{typename DenseOperator<TypeParam>::Matrix(0, 0)};
  EXPECT_EQ(none.apply_transpose(Eigen::MatrixXcd(0, 2)).cols(), 2);
  const DenseOperator<TypeParam> one{
      DenseOperator<TypeParam>::Matrix::Constant(1, 1, std::complex<TypeParam>(0, TypeParam{2}))};
  EXPECT_EQ(one.apply(Eigen::MatrixXcd::Ones(1, 1))(0, 0), std::complex<double>(0, 2));
}

TYPED_TEST(DenseOperatorTest, RefusesOtherShapes) {
  using Matrix = typename DenseOperator<TypeParam>::Matrix;
  EXPECT_THROW(DenseOperator<TypeParam>(Matrix::Zero(3, 4)), std::invalid_argument);
  EXPECT_THROW(this->operator_.apply(Eigen::MatrixXcd::Zero(this->kSize + 1, 1)), std::invalid_argument);
  EXPECT_THROW(this->operator_.apply_transpose(Eigen::MatrixXcd::Zero(1, 1)), std::invalid_argument);
}

}  // namespace touchfield::dense_operator_test
