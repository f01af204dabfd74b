#include <cmath>

#include <gtest/gtest.h>

#include "sim/bem/boundary_operator.h"
#include "sim/bem/layer_sum.h"
#include "sim/hand/shapes.h"
#include "tests/support/reference_kernels.h"

namespace touchfield::near_corrections_test {

const Complex kWavenumber(732.28, 0.152);
constexpr double kGamma = 1.0 / 732.28;

TriangleMesh mesh() { return icosphere(8e-3, 4); }

Eigen::MatrixXcd stored(const NearCorrections& near) {
  Eigen::MatrixXcd matrix = Eigen::MatrixXcd::Zero(near.size(), near.size());
  near.add_to<double>(1.0, matrix);
  return matrix;
}

TEST(NearCorrections, HoldTheIntegralMinusItsOnePointWithinReach) {
  const TriangleMesh m = mesh();
  const FaceRule rule{.split_ratio = 1.4, .seven_below = 2.0, .three_below = 5.0};
  for (const Layer layer : {Layer::kDouble, Layer::kBurtonMiller}) {
    const NearCorrections near(m, kWavenumber, kGamma, layer, rule);
    const Eigen::MatrixXcd matrix = stored(near);
    FaceQuadrature quadrature(kWavenumber, kGamma, rule);
    std::size_t pairs = 0;
    for (Eigen::Index i = 0; i < m.face_count(); ++i) {
      const Vector3 x = m.centroids().col(i);
      for (Eigen::Index j = 0; j < m.face_count(); ++j) {
        const bool within = (x - m.centroids().col(j)).norm() < 5.0 * std::sqrt(m.areas()(j)) && i != j;
        pairs += within ? 1 : 0;
        Complex expected = 0;
        if (within) {
          quadrature.begin(x, m.normals().col(i));
          quadrature.add(face_of(m, j));
          const ReferenceKernels kernels =
              reference_kernels(x, m.normals().col(i), m.centroids().col(j), m.normals().col(j), kWavenumber);
          expected = quadrature.integrals(layer)[0] - m.areas()(j) * reference_value(layer, kernels, kGamma);
        }
        ASSERT_LT(std::abs(matrix(i, j) - expected), 1e-13) << i << ", " << j;  // entries of W reach some tenths
      }
    }
    EXPECT_EQ(near.pairs(), pairs);
    EXPECT_GT(pairs, 10U * 320U);
  }
}

TEST(NearCorrections, ProductsAreThoseOfTheStoredMatrix) {
  const TriangleMesh m = mesh();
  const NearCorrections near(m, kWavenumber, kGamma, Layer::kBurtonMiller, {});
  const Eigen::MatrixXcd matrix = stored(near);
  const Complex factor(0.3, -2.0);
  std::srand(1);
  const Eigen::MatrixXcd x = Eigen::MatrixXcd::Random(m.face_count(), 3);
  const Eigen::MatrixXcd before = Eigen::MatrixXcd::Random(m.face_count(), 3);
  Eigen::MatrixXcd y = before;
  near.add_product(factor, x, y);
  EXPECT_LT((y - before - factor * matrix * x).norm(), 1e-13 * y.norm());
  y = before;
  near.add_transposed_product(factor, x, y);
  EXPECT_LT((y - before - factor * matrix.transpose() * x).norm(), 1e-13 * y.norm());
  const std::vector<Eigen::Index> faces = {319, 0, 7};
  Eigen::MatrixXcd columns = before;
  near.add_columns(factor, faces, columns);
  EXPECT_LT((columns - before - factor * matrix(Eigen::all, faces)).norm(), 1e-13 * columns.norm());
  Eigen::MatrixXcf single = Eigen::MatrixXcf::Zero(m.face_count(), m.face_count());
  near.add_to<float>(factor, single);
  EXPECT_LT((single.cast<Complex>() - factor * matrix).norm(), 1e-7 * matrix.norm());
}

TEST(NearCorrections, ARuleWithoutReachHoldsNothing) {
  const NearCorrections near(mesh(), kWavenumber, kGamma, Layer::kDouble, {0.0, 0.0, 0.0});
  EXPECT_EQ(near.pairs(), 0U);
  EXPECT_EQ(near.size(), 320);
  EXPECT_EQ(stored(near).norm(), 0.0);
}

}  // namespace touchfield::near_corrections_test
