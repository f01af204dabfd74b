#include "sim/run/transfer.h"

#include "sim/hand/shapes.h"
#include "sim/run/skin_scattering.h"
#include "solvers/phase/surface.h"
#include "tests/support/testing.h"

namespace touchfield::transfer_test {

Wave audible_wave() { return Wave(air(293.15), 40e3); }

TransducerArray grid_array(int count, double below) {
  ArrayLayout layout = grid_layout(count, count, 10.16e-3);
  layout.positions.row(2).array() -= below;
  return make_array(layout, Directivity::omni(), 1.0, 4.386);
}

TEST(TransferMatrix, TimesDrivesIsTheirPressure) {
  const Wave wave = audible_wave();
  const TransducerArray array = grid_array(6, 0.08);
  const TriangleMesh mesh = sphere(6e-3, 3e-3).mesh;
  const Eigen::MatrixXcd h = transfer_matrix(mesh, wave, array, Scheme::kBurtonMillerPolished, {.tolerance = 1e-6});
  ASSERT_EQ(h.rows(), mesh.face_count());
  ASSERT_EQ(h.cols(), array.size());
  std::vector<SolveRecord> records;
  Progress silent;
  SkinScattering scattering(mesh, wave, Scheme::kBurtonMillerPolished, {.tolerance = 1e-6}, array, records, silent);
  const Eigen::MatrixXcd drives = random_start(array.size(), 3);
  const Eigen::MatrixXcd p = scattering.pressure(drives, "test");
  EXPECT_LT((h * drives - p).norm(), 2e-4 * p.norm());
  const Eigen::MatrixXcd rows = scattering.transfer_rows({0, 7}, "test");
  EXPECT_LT((h({0, 7}, Eigen::all) - rows).norm(), 1e-3 * rows.norm());
}

TEST(TransferMatrix, IsNoneWhereASolveMissesItsTolerance) {
  const SolverSpec hasty{.solver = SolverChoice::kMatrixFree, .tolerance = 1e-10, .max_steps = 1};
  EXPECT_THROW(transfer_matrix(sphere(6e-3, 3e-3).mesh, audible_wave(), grid_array(4, 0.08), kDefaultScheme, hasty),
               NumericalError);
}

// What a sweep rests on: the same drives press alike wherever body and array stand together.
TEST(KeptModels, AMovedBodyIsRecognisedAndAnotherIsNot) {
  const Wave wave = audible_wave();
  const TriangleMesh mesh = sphere(6e-3, 3e-3).mesh;
  KeptModels kept;
  const SolverSpec spec;
  const auto first = kept.get("solve", mesh, wave, Scheme::kPaper, spec, 1);
  Points nudged = mesh.vertices();
  nudged(0, 0) += 0.5e-9;
  EXPECT_EQ(kept.get("solve", TriangleMesh(nudged, mesh.triangles()), wave, Scheme::kPaper, spec, 1), first);
  EXPECT_NE(kept.get("evaluation", mesh, wave, Scheme::kPaper, spec, 1), first);
  EXPECT_NE(kept.get("solve", mesh, wave, Scheme::kPaperCorrected, spec, 1), first);
  const auto second = kept.get("solve", mesh, wave, Scheme::kPaper, spec, 1);
  EXPECT_NE(second, first);  // only the last one of a role is kept
  nudged(0, 0) += 2e-9;
  EXPECT_NE(kept.get("solve", TriangleMesh(nudged, mesh.triangles()), wave, Scheme::kPaper, spec, 1), second);
  const auto third = kept.get("solve", mesh, wave, Scheme::kPaper, spec, 1);
  EXPECT_NE(kept.get("solve", mesh, Wave(air(294.0), 40e3), Scheme::kPaper, spec, 1), third);
  const SolverSpec tighter{.tolerance = 1e-6};
  const auto fourth = kept.get("solve", mesh, wave, Scheme::kPaper, spec, 1);
  EXPECT_NE(kept.get("solve", mesh, wave, Scheme::kPaper, tighter, 1), fourth);
}

}  // namespace touchfield::transfer_test
