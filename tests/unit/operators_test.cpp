#include "sim/bem/operators.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <omp.h>

#include "sim/bem/scattering_system.h"
#include "sim/core/errors.h"
#include "sim/mesh/shapes.h"

namespace touchfield {
namespace {

Wave wave() { return {air(293.15), 40e3}; }

TEST(PaperOperator, AnEntryByHand) {
  // Two faces of a mesh: x_i - x_j and n_j by hand, B_ij = -A_j (1 - ikr) exp(ikr) n_j.(x_i - x_j) / (4 pi r^3).
  Points vertices(3, 6);
  vertices << 0, 3, 0, 0, 0, 0,  //
      0, 0, 3, 0, 3, 0,          //
      0, 0, 0, 5, 5, 8;
  vertices *= 1e-3;
  Triangles triangles(3, 2);
  triangles << 0, 3,  //
      1, 4,           //
      2, 5;
  const TriangleMesh mesh(vertices, triangles);
  const Eigen::MatrixXcd b = paper_matrix(mesh, wave());
  // Face 0: centroid (1, 1, 0) mm, normal +z, 4.5 mm2. Face 1: centroid (0, 1, 6) mm, normal +x, 4.5 mm2.
  const double k = wave().k();
  const double r = 1e-3 * std::sqrt(37.0);
  const Complex shared =
      -4.5e-6 * Complex(1.0, -k * r) * std::exp(Complex(0, k * r)) / (4.0 * std::numbers::pi * r * r * r);
  EXPECT_LT(std::abs(b(1, 0) - shared * 6e-3), 1e-13 * std::abs(b(1, 0)));  // n_0.(x_1 - x_0) = +6 mm
  EXPECT_LT(std::abs(b(0, 1) - shared * 1e-3), 1e-13 * std::abs(b(0, 1)));  // n_1.(x_0 - x_1) = +1 mm
  EXPECT_EQ(b(0, 0), 0.5);
  EXPECT_EQ(b(1, 1), 0.5);
}

TEST(PaperOperator, StoredAndMatrixFreeAgree) {
  const TriangleMesh mesh = icosphere(8e-3, 4);
  const Eigen::MatrixXcd b = paper_matrix(mesh, wave());
  const PaperOperator free(mesh, wave());
  std::srand(1);
  const Eigen::MatrixXcd x = Eigen::MatrixXcd::Random(b.rows(), 3);
  // The same entries summed in another order: a few roundings of 320 terms.
  EXPECT_LT((free.apply(x) - b * x).norm(), 1e-13 * x.norm());
  EXPECT_LT((free.apply_transpose(x) - b.transpose() * x).norm(), 1e-13 * x.norm());
  EXPECT_EQ(free.size(), 320);
  EXPECT_EQ(paper_columns(mesh, wave(), {5, 319}), b(Eigen::all, std::vector<int>{5, 319}));
  EXPECT_THROW(free.apply(Eigen::MatrixXcd::Zero(319, 1)), std::invalid_argument);
}

TEST(PaperOperator, AbsorptionDampsEveryEntry) {
  // B_ij = -A_j (1 - i kappa r) exp(i kappa r) n_j.(x_i - x_j) / (4 pi r^3) with kappa = k + i alpha, by complex
  // arithmetic.
  const TriangleMesh mesh = icosphere(8e-3, 2);
  Medium medium = air(293.15);
  medium.absorption = 20.0;
  const Wave damped(medium, 40e3);
  const Eigen::MatrixXcd b = paper_matrix(mesh, damped);
  const PaperOperator free(mesh, damped);
  const Eigen::MatrixXcd identity = Eigen::MatrixXcd::Identity(b.rows(), b.rows());
  EXPECT_LT((free.apply(identity) - b).norm(), 1e-13 * b.norm());
  EXPECT_LT((free.apply_transpose(identity) - b.transpose()).norm(), 1e-13 * b.norm());
  for (const auto& [i, j] : {std::pair{0, 5}, std::pair{79, 3}}) {
    const Vector3 offset = mesh.centroids().col(i) - mesh.centroids().col(j);
    const double r = offset.norm();
    const Complex ikr = Complex(0, r) * damped.wavenumber();
    const Complex expected = -mesh.areas()(j) * (1.0 - ikr) * std::exp(ikr) * offset.dot(mesh.normals().col(j)) /
                             (4.0 * std::numbers::pi * r * r * r);
    EXPECT_LT(std::abs(b(i, j) - expected), 1e-13 * std::abs(expected));
  }
}

TEST(PaperOperator, TransposeIsTheAdjointOfTheBilinearForm) {
  const TriangleMesh mesh = icosphere(8e-3, 3);
  const PaperOperator op(mesh, wave());
  std::srand(2);
  const Eigen::VectorXcd x = Eigen::VectorXcd::Random(op.size());
  const Eigen::VectorXcd y = Eigen::VectorXcd::Random(op.size());
  const Complex left = (y.transpose() * op.apply(x))(0);
  const Complex right = (op.apply_transpose(y).transpose() * x)(0);
  EXPECT_LT(std::abs(left - right), 1e-12 * x.norm() * y.norm());
}

TEST(PaperOperator, PermutedFacesGiveThePermutedMatrix) {
  const TriangleMesh mesh = icosphere(8e-3, 2);
  Triangles reversed = mesh.triangles().rowwise().reverse();
  const Eigen::MatrixXcd b = paper_matrix(mesh, wave());
  const Eigen::MatrixXcd permuted = paper_matrix(TriangleMesh(mesh.vertices(), reversed), wave());
  EXPECT_EQ(permuted, b.reverse());
}

TEST(ScatteringSystem, LuSolvesWhatTheReferenceOperatorDescribes) {
  const TriangleMesh mesh = icosphere(8e-3, 5);
  const ScatteringSystem system(mesh, wave(), Scheme::kPaper);
  const auto solver = factorise_dense(system);
  std::srand(3);
  const Eigen::MatrixXcd b = Eigen::MatrixXcd::Random(system.size(), 2);
  EXPECT_LT(relative_residual(system, solver->solve(b), b), 1e-12);
  const Eigen::MatrixXcd transposed = solver->solve_transpose(b);
  EXPECT_LT((system.reference_operator().apply_transpose(transposed) - b).norm(), 1e-12 * b.norm());
  EXPECT_GT(solver->reciprocal_condition(), 1e-4);
}

TEST(ScatteringSystem, DoesNotDependOnTheThreadCount) {
  const TriangleMesh mesh = icosphere(8e-3, 6);
  const ScatteringSystem system(mesh, wave(), Scheme::kPaper);
  const Eigen::MatrixXcd b = system.right_hand_sides(plane_wave(Vector3::UnitZ(), 1.0));
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const Eigen::MatrixXcd one = factorise_dense(system)->solve(b);
  omp_set_num_threads(3);
  const Eigen::MatrixXcd three = factorise_dense(system)->solve(b);
  omp_set_num_threads(threads);
  EXPECT_LT((one - three).norm(), 1e-12 * one.norm());
}

}  // namespace
}  // namespace touchfield
