#include "sim/bem/scattering_system.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "sim/acoustics/incident_field.h"
#include "solvers/linear/factorisations.h"
#include "tests/support/sphere_support.h"

namespace touchfield::scattering_system_test {

TriangleMesh mesh() { return icosphere(7e-3, 3); }  // ka 5.13, 180 faces

TransducerArray four_channels() {
  Points at(3, 4);
  at << 0.01, -0.03, 0.002, 0.05,  //
      0.02, 0.0, 0.01, -0.04,      //
      0.15, 0.12, -0.1, 0.02;
  return omni_at(at);
}

class EveryScheme : public ::testing::TestWithParam<Scheme> {
 protected:
  const ScatteringSystem system_{mesh(), wave(), GetParam()};
  const IncidentField unit_ = system_.incident(four_channels());
};

INSTANTIATE_TEST_SUITE_P(ScatteringSystem, EveryScheme, ::testing::ValuesIn(all_schemes()),
                         [](const auto& info) { return to_string(info.param); });

TEST_P(EveryScheme, ItsFormsOfBAgree) {
  const Eigen::MatrixXcd b = system_.dense();
  ASSERT_EQ(b.rows(), system_.faces());
  std::srand(1);
  const Eigen::MatrixXcd x = Eigen::MatrixXcd::Random(system_.faces(), 2);
  EXPECT_LT((system_.exact().apply(x) - b * x).norm(), 1e-12 * x.norm());
  EXPECT_LT((system_.exact().apply_transpose(x) - b.transpose() * x).norm(), 1e-12 * x.norm());
  EXPECT_LT((system_.single_operator()->apply(x) - b * x).norm(), 1e-5 * x.norm());
  EXPECT_LT((system_.dense_single().cast<Complex>() - b).norm(), 1e-5 * b.norm());
  const std::vector<Eigen::Index> faces = {179, 0, 42};
  EXPECT_LT((system_.columns(faces) - b(Eigen::all, faces)).norm(), 1e-12 * b.col(0).norm());
}

TEST_P(EveryScheme, RowsOfTheRightHandSideAreThoseOfAll) {
  const std::vector<Eigen::Index> rows = {system_.faces() - 1, 0, 42};
  const Eigen::MatrixXcd b = system_.right_hand_side(unit_)(rows, Eigen::all);
  EXPECT_LT((system_.right_hand_side_rows(four_channels(), rows) - b).norm(), 1e-12 * b.norm());
}

TEST_P(EveryScheme, TransferRowsAreThoseOfTheMatrixMadeColumnByColumn) {
  const DenseLu lu(system_.dense());
  Eigen::MatrixXcd h(system_.faces(), 4);
  for (Eigen::Index n = 0; n < 4; ++n) {
    const IncidentField one = driven(unit_, Eigen::MatrixXcd::Identity(4, 4).col(n));
    h.col(n) = system_.pressure(lu.solve(system_.right_hand_side(one)), one);
  }
  const std::vector<Eigen::Index> faces = {100, 3, 179};
  const Eigen::Index m = system_.faces();
  const Eigen::MatrixXcd weights = Eigen::MatrixXcd::Identity(m, m)(Eigen::all, faces);
  const Eigen::MatrixXcd x = lu.solve_transpose(system_.transposed_right_hand_side(weights));
  const Eigen::MatrixXcd rows = system_.weighted_rows(weights, x, unit_);
  // Polishing multiplies in single precision.
  const double tolerance = GetParam() == Scheme::kBurtonMillerPolished ? 1e-5 : 1e-11;
  EXPECT_LT((rows - h(faces, Eigen::all)).norm(), tolerance * rows.norm());
}

TEST(ScatteringSystem, DiagonalsOfTheSchemes) {
  const TriangleMesh m = mesh();
  EXPECT_EQ(ScatteringSystem(m, wave(), Scheme::kPaper).dense().diagonal(), Eigen::VectorXcd::Constant(180, 0.5));
  const Eigen::VectorXcd corrected = gauss_diagonal(m).cast<Complex>();
  EXPECT_EQ(ScatteringSystem(m, wave(), Scheme::kPaperCorrected).dense().diagonal(), corrected);
  // 1/2 - eta W.
  SystemOptions options;
  options.coupling = 0.3;
  const Complex eta(0, 0.3 / wave().k());
  const Complex w = self_integrals(face_of(m, 17), wave().wavenumber()).hypersingular;
  const ScatteringSystem combined(m, wave(), Scheme::kBurtonMiller, options);
  EXPECT_LT(std::abs(combined.dense()(17, 17) - (0.5 - eta * w)), 1e-15);
}

TEST(ScatteringSystem, ChiefAddsTheRowsOfItsPoints) {
  // C_zj = -A_j dg/dn_j (z, x_j) built by complex arithmetic, each row scaled to the length 1; their
  // square is added to B of paper_corrected.
  const ScatteringSystem system(mesh(), wave(), Scheme::kChief);
  const Points& z = system.interior_points();
  const TriangleMesh& m = system.mesh();
  Eigen::MatrixXcd c(z.cols(), m.face_count());
  for (Eigen::Index i = 0; i < c.rows(); ++i) {
    for (Eigen::Index j = 0; j < c.cols(); ++j) {
      const Vector3 d = z.col(i) - m.centroids().col(j);
      const Complex ikr(0, wave().k() * d.norm());
      c(i, j) = -m.areas()(j) * (1.0 - ikr) * std::exp(ikr) * m.normals().col(j).dot(d) /
                (4.0 * std::numbers::pi * std::pow(d.norm(), 3));
    }
  }
  const Eigen::VectorXd scale = c.rowwise().norm().cwiseInverse();
  c = scale.asDiagonal() * c;
  const Eigen::MatrixXcd expected = ScatteringSystem(m, wave(), Scheme::kPaperCorrected).dense() + c.adjoint() * c;
  EXPECT_LT((system.dense() - expected).norm(), 1e-13 * expected.norm());
  // To the right-hand side the incident pressure at the points is added likewise.
  const IncidentField unit = system.incident(four_channels());
  const Eigen::MatrixXcd at_points = scale.asDiagonal() * incident_matrix(four_channels(), wave(), z);
  const Eigen::MatrixXcd b = unit.pressure + c.adjoint() * at_points;
  EXPECT_LT((system.right_hand_side(unit) - b).norm(), 1e-13 * b.norm());
}

TEST(ScatteringSystem, BurtonMillersRightHandSideHasTheSlope) {
  // e + eta de/dn with de/dn by central differences; their error is k^3 h^2 / 6 of e: 7e-5 of k e.
  const ScatteringSystem system(mesh(), wave(), Scheme::kBurtonMiller);
  const TransducerArray array = four_channels();
  const Points& x = system.mesh().centroids();
  const Points& n = system.mesh().normals();
  constexpr double kStep = 1e-6;
  const Eigen::MatrixXcd slope =
      (incident_matrix(array, wave(), x + kStep * n) - incident_matrix(array, wave(), x - kStep * n)) / (2 * kStep);
  const Eigen::MatrixXcd expected = incident_matrix(array, wave(), x) + Complex(0, 1.0 / wave().k()) * slope;
  const Eigen::MatrixXcd b = system.right_hand_side(system.incident(array));
  EXPECT_LT((b - expected).norm(), 1e-6 * b.norm());
}

TEST(ScatteringSystem, PolishingIsTwoFixedPointSteps) {
  // p += e - B_c p twice, with B_c of paper_corrected.
  const ScatteringSystem polished(mesh(), wave(), Scheme::kBurtonMillerPolished);
  const Eigen::MatrixXcd corrected = ScatteringSystem(mesh(), wave(), Scheme::kPaperCorrected).dense();
  const IncidentField unit = polished.incident(four_channels());
  std::srand(3);
  const Eigen::MatrixXcd x = Eigen::MatrixXcd::Random(180, 4);
  Eigen::MatrixXcd expected = x + unit.pressure - corrected * x;
  expected += unit.pressure - corrected * expected;
  EXPECT_LT((polished.pressure(x, unit) - expected).norm(), 1e-5 * expected.norm());  // sums in single precision
  const ScatteringSystem plain(mesh(), wave(), Scheme::kBurtonMiller);
  EXPECT_EQ(plain.pressure(x, unit), x);
  EXPECT_EQ(polished.dense(), plain.dense());
}

}  // namespace touchfield::scattering_system_test
