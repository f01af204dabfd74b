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

}  // namespace touchfield::dense_operator_test
