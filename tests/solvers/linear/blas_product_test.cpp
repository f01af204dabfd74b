#include "solvers/linear/blas_product.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/linear_support.h"
#include "tests/support/threads_support.h"

namespace touchfield::blas_product_test {

// Sums of 300 products of numbers below 1.5: rounding stays below 300 eps.
constexpr double kRounding = 1e-13;

TEST(HermitianProduct, EqualsTheDefinitionAcrossBlockBorders) {
  for (const Eigen::Index columns : {1, 127, 128, 129, 300}) {
    const Eigen::MatrixXcd a = random_matrix(300, columns, 1);
    const Eigen::MatrixXcd expected = a.adjoint() * a;
    EXPECT_LT((hermitian_product(a) - expected).norm(), kRounding * expected.norm()) << columns << " columns";
  }
}

TEST(HermitianProduct, AdjointProductEqualsTheDefinition) {
  const Eigen::MatrixXcd a = random_matrix(300, 40, 3);
  const Eigen::MatrixXcd b = random_matrix(300, 150, 4);
  const Eigen::MatrixXcd expected = a.adjoint() * b;
  EXPECT_LT((adjoint_product(a, b) - expected).norm(), kRounding * expected.norm());
  EXPECT_THROW(adjoint_product(a, random_matrix(299, 2, 5)), std::invalid_argument);
}

TEST(HermitianProduct, DoesNotDependOnTheThreadCountToTheLastBit) {
  const Eigen::MatrixXcd a = random_matrix(500, 400, 6);
  const auto squared = [&] { return hermitian_product(a); };
  const auto mixed = [&] { return adjoint_product(a, a.leftCols(150)); };
  EXPECT_EQ(with_threads(4, squared), with_threads(1, squared));
  EXPECT_EQ(with_threads(4, mixed), with_threads(1, mixed));
}

}  // namespace touchfield::blas_product_test
