#include "sim/bem/boundary_operator.h"

#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "sim/acoustics/medium.h"
#include "sim/bem/quadrature.h"
#include "sim/hand/shapes.h"
#include "tests/support/reference_kernels.h"

namespace touchfield::boundary_operator_test {

Wave wave() { return {air(293.15), 40e3}; }

BoundaryParts paper_parts(const TriangleMesh& mesh) {
  return {Layer::kDouble, 0.0, Eigen::VectorXcd::Constant(mesh.face_count(), 0.5), nullptr};
}

/// Burton-Miller with a diagonal of its own on every face.
BoundaryParts combined_parts(const TriangleMesh& mesh, const Complex& wavenumber) {
  const double gamma = 1.0 / wavenumber.real();
  Eigen::VectorXcd diagonal(mesh.face_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    diagonal(f) = Complex(0.5 + 0.001 * static_cast<double>(f), 0.7);
  }
  return {Layer::kBurtonMiller, gamma, diagonal,
          std::make_shared<NearCorrections>(mesh, wavenumber, gamma, Layer::kBurtonMiller, FaceRule{})};
}

template <typename Real>
class BoundaryOperators : public ::testing::Test {
 public:
  static constexpr double kTolerance = std::is_same_v<Real, float> ? 1e-5 : 1e-12;  // of sums of 320 entries
};

using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(BoundaryOperators, Reals);

TYPED_TEST(BoundaryOperators, StoredAndMatrixFreeAgree) {
  const TriangleMesh mesh = icosphere(8e-3, 4);
  std::srand(1);
  const Eigen::MatrixXcd x = Eigen::MatrixXcd::Random(mesh.face_count(), 3);
  for (const double alpha : {0.0, 20.0}) {
    const Complex wavenumber(wave().k(), alpha);
    for (const BoundaryParts& parts : {paper_parts(mesh), combined_parts(mesh, wavenumber)}) {
      const BoundaryOperator<TypeParam> op(mesh, wavenumber, parts);
      const Eigen::MatrixXcd b = op.dense().template cast<Complex>();
      ASSERT_EQ(op.size(), 320);
      EXPECT_LT((op.apply(x) - b * x).norm(), TestFixture::kTolerance * x.norm());
      EXPECT_LT((op.apply_transpose(x) - b.transpose() * x).norm(), TestFixture::kTolerance * x.norm());
      const std::vector<Eigen::Index> faces = {319, 5, 0};
      EXPECT_LT((op.columns(faces) - b(Eigen::all, faces)).norm(), TestFixture::kTolerance * b.col(0).norm());
      // The block's place in a larger matrix; the rest stays.
      typename BoundaryOperator<TypeParam>::Matrix larger(323, 322);
      larger.setConstant(TypeParam(7));
      op.fill_dense(larger);
      EXPECT_LT((larger.topLeftCorner(320, 320).template cast<Complex>() - b).norm(),
                TestFixture::kTolerance * b.norm());
      EXPECT_EQ(larger.bottomRows(3).cwiseAbs().minCoeff(), TypeParam(7));
      EXPECT_EQ(larger.rightCols(2).cwiseAbs().maxCoeff(), TypeParam(7));
    }
  }
}

TEST(BoundaryOperator, CorrectedDiagonalKeepsAConstantPressureAtRest) {
  // At k = 0 a constant is a solution of p/2 - D p = p_inc with p = p_inc: the rows of B sum to 1 whatever the shape.
  const TriangleMesh mesh = capsule(5e-3, 12e-3, 2e-3).mesh;
  const Eigen::VectorXd diagonal = gauss_diagonal(mesh);
  for (Eigen::Index i = 0; i < mesh.face_count(); ++i) {
    double sum = diagonal(i);
    for (Eigen::Index j = 0; j < mesh.face_count(); ++j) {
      if (i != j) {
        const Vector3 offset = mesh.centroids().col(i) - mesh.centroids().col(j);
        sum -= mesh.areas()(j) * static_double_layer_kernel(offset, mesh.normals().col(j));
      }
    }
    EXPECT_NEAR(sum, 1.0, 1e-13) << i;
  }
  EXPECT_GT(diagonal.minCoeff(), 0.5);  // a convex body of flat faces
  EXPECT_LT(diagonal.maxCoeff(), 0.7);
  // The same through the operator at 5 Hz, where ka is 5e-4.
  const BoundaryOperator<double> op(mesh, 0.1, {Layer::kDouble, 0.0, diagonal.cast<Complex>(), nullptr});
  const Eigen::VectorXcd sums = op.apply(Eigen::VectorXcd::Ones(op.size()));
  EXPECT_LT((sums.array() - 1.0).abs().maxCoeff(), 1e-6);
}

}  // namespace touchfield::boundary_operator_test
