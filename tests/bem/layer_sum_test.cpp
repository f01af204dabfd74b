#include "sim/bem/layer_sum.h"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "sim/bem/boundary_operator.h"
#include "sim/hand/shapes.h"
#include "tests/support/reference_kernels.h"

namespace touchfield::layer_sum_test {

constexpr double kWavenumber = 732.28;        // 40 kHz
constexpr double kGamma = 0.8 / kWavenumber;  // any number but 1/k
constexpr Layer kTransposable[] = {Layer::kDouble, Layer::kBurtonMiller};

/// A_j K(x_i, x_j), 0 on the diagonal.
Eigen::MatrixXcd reference_matrix(Layer layer, const TriangleMesh& mesh, const Complex& wavenumber) {
  const Eigen::Index m = mesh.face_count();
  Eigen::MatrixXcd matrix = Eigen::MatrixXcd::Zero(m, m);
  for (Eigen::Index j = 0; j < m; ++j) {
    for (Eigen::Index i = 0; i < m; ++i) {
      if (i != j) {
        matrix(i, j) = mesh.areas()(j) *
                       reference_value(layer,
                                       reference_kernels(mesh.centroids().col(i), mesh.normals().col(i),
                                                         mesh.centroids().col(j), mesh.normals().col(j), wavenumber),
                                       kGamma);
      }
    }
  }
  return matrix;
}

template <typename Real>
class LayerSums : public ::testing::Test {
 public:
  // Float keeps coordinates of some half wavelengths to 1e-7 of one; neighbours a twentieth of that apart lose a digit.
  static constexpr double kTolerance = std::is_same_v<Real, float> ? 1e-5 : 1e-12;
};

using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(LayerSums, Reals);

TYPED_TEST(LayerSums, ProductsAreThoseOfThePlainFormulas) {
  std::srand(1);
  for (const int subdivisions : {1, 3, 5}) {  // 20, 180 and 500 faces: no multiple of a register, tile or pass
    // Far from the origin: coordinates must not lose what single precision has.
    const TriangleMesh mesh =
        transformed(icosphere(8e-3, subdivisions), Eigen::Matrix3d::Identity(), Vector3(0.1, -0.2, 0.3));
    for (const auto& [alpha, columns] : {std::pair(0.0, 3), std::pair(20.0, 3), std::pair(20.0, 13)}) {  // 13: by GEMM
      const Eigen::MatrixXcd x = Eigen::MatrixXcd::Random(mesh.face_count(), columns);
      const Complex wavenumber(kWavenumber, alpha);
      const LayerSum<TypeParam> sum(mesh, wavenumber, kGamma);
      for (const Layer layer : {Layer::kSingle, Layer::kDouble, Layer::kAdjoint, Layer::kBurtonMiller,
                                Layer::kAdjointMiller, Layer::kSingleAdjoint}) {
        const Eigen::MatrixXcd expected = reference_matrix(layer, mesh, wavenumber) * x;
        EXPECT_LT((sum.apply(layer, x) - expected).norm(), TestFixture::kTolerance * expected.norm())
            << mesh.face_count() << " faces, layer " << static_cast<int>(layer) << ", alpha " << alpha;
      }
      for (const Layer layer : kTransposable) {
        const Eigen::MatrixXcd expected = reference_matrix(layer, mesh, wavenumber).transpose() * x;
        EXPECT_LT((sum.apply_transpose(layer, x) - expected).norm(), TestFixture::kTolerance * expected.norm())
            << mesh.face_count() << " faces, layer " << static_cast<int>(layer) << ", alpha " << alpha;
      }
    }
  }
}

const Complex kDamped(kWavenumber, 0.152);

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
    const NearCorrections near(m, kDamped, kGamma, layer, rule);
    const Eigen::MatrixXcd matrix = stored(near);
    FaceQuadrature quadrature(kDamped, kGamma, rule);
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
              reference_kernels(x, m.normals().col(i), m.centroids().col(j), m.normals().col(j), kDamped);
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
  const NearCorrections near(m, kDamped, kGamma, Layer::kBurtonMiller, {});
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

}  // namespace touchfield::layer_sum_test
