#include "sim/bem/layer_sum.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

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

TYPED_TEST(LayerSums, TransposeIsTheAdjointOfTheBilinearForm) {
  const LayerSum<TypeParam> sum(icosphere(8e-3, 5), {kWavenumber, 0.0}, kGamma);
  std::srand(2);
  const Eigen::VectorXcd x = Eigen::VectorXcd::Random(sum.size());
  const Eigen::VectorXcd y = Eigen::VectorXcd::Random(sum.size());
  for (const Layer layer : kTransposable) {
    const Complex left = (y.transpose() * sum.apply(layer, x))(0);
    const Complex right = (sum.apply_transpose(layer, y).transpose() * x)(0);
    EXPECT_LT(std::abs(left - right), TestFixture::kTolerance * y.norm() * sum.apply(layer, x).norm());
  }
}

TYPED_TEST(LayerSums, ColumnsAreThoseOfTheMatrix) {
  const TriangleMesh mesh = icosphere(8e-3, 5);
  const Complex wavenumber(kWavenumber, 0.152);
  const LayerSum<TypeParam> sum(mesh, wavenumber, kGamma);
  Eigen::Matrix<std::complex<TypeParam>, Eigen::Dynamic, 1> column;
  for (const Layer layer : kTransposable) {
    const Eigen::MatrixXcd matrix = reference_matrix(layer, mesh, wavenumber);
    for (const Eigen::Index j : {0, 255, 256, 499}) {
      sum.column(layer, j, column);
      EXPECT_EQ(column(j), std::complex<TypeParam>(0));
      EXPECT_LT((column.template cast<Complex>() - matrix.col(j)).norm(),
                TestFixture::kTolerance * matrix.col(j).norm());
    }
  }
}

TYPED_TEST(LayerSums, RowsOfPointsOffTheCentroids) {
  const TriangleMesh mesh = icosphere(8e-3, 5);
  const Complex wavenumber(kWavenumber, 0.152);
  Points points(3, 2);
  points << 1e-3, -2e-3,  //
      0, 4e-3,            //
      2e-3, 9e-3;
  const LayerSum<TypeParam> sum(mesh, wavenumber, 0.0);
  for (const Layer layer : {Layer::kSingle, Layer::kDouble}) {
    Eigen::MatrixXcd expected(2, mesh.face_count());
    for (Eigen::Index z = 0; z < 2; ++z) {
      for (Eigen::Index j = 0; j < mesh.face_count(); ++j) {
        expected(z, j) = mesh.areas()(j) *
                         reference_value(layer,
                                         reference_kernels(points.col(z), Vector3::UnitZ(), mesh.centroids().col(j),
                                                           mesh.normals().col(j), wavenumber),
                                         0.0);
      }
    }
    EXPECT_LT((sum.rows(layer, points) - expected).norm(), TestFixture::kTolerance * expected.norm());
  }
  EXPECT_EQ(sum.rows(Layer::kDouble, Points(3, 0)).rows(), 0);
}

TYPED_TEST(LayerSums, CentroidsThatCoincideAddNothing) {
  // Each face twice: the sum over the pair's other half is 0 as that over the face itself is.
  const TriangleMesh once = icosphere(8e-3, 2);
  Triangles doubled(3, 160);
  doubled << once.triangles(), once.triangles();
  const LayerSum<TypeParam> twice(TriangleMesh(once.vertices(), doubled), {kWavenumber, 0.0}, kGamma);
  const LayerSum<TypeParam> sum(once, {kWavenumber, 0.0}, kGamma);
  const Eigen::VectorXcd two = twice.apply(Layer::kBurtonMiller, Eigen::VectorXcd::Ones(160));
  const Eigen::VectorXcd one = sum.apply(Layer::kBurtonMiller, Eigen::VectorXcd::Ones(80));
  EXPECT_LT((two.head(80) - 2.0 * one).norm(), TestFixture::kTolerance * one.norm());
}

TYPED_TEST(LayerSums, RefusesWhatItCannotMultiply) {
  const LayerSum<TypeParam> sum(icosphere(8e-3, 1), {kWavenumber, 0.0}, 0.0);
  EXPECT_THROW(sum.apply(Layer::kDouble, Eigen::MatrixXcd::Zero(19, 1)), std::invalid_argument);
  EXPECT_THROW(sum.apply_transpose(Layer::kDouble, Eigen::MatrixXcd::Zero(21, 1)), std::invalid_argument);
  EXPECT_THROW(sum.apply_transpose(Layer::kSingle, Eigen::MatrixXcd::Zero(20, 1)), std::invalid_argument);
  EXPECT_EQ(sum.apply(Layer::kDouble, Eigen::MatrixXcd::Zero(20, 0)).cols(), 0);
}

}  // namespace touchfield::layer_sum_test
