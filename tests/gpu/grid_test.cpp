#include <gtest/gtest.h>

#include "sim/bem/scattering_system.h"
#include "sim/gpu/on_card.h"
#include "tests/gpu/surface_support.h"

namespace touchfield {
namespace gpu_grid_test {

std::vector<GpuSurface> surfaces() {
  HandOptions options;
  options.edge = 3.2e-3;
  auto all = gpu_surfaces();
  all.push_back({"whole hand", hand(options).mesh});
  return all;
}

class GpuGridSums : public CardTest {
 protected:
  static ScatteringSystem system(const TriangleMesh& mesh, const Wave& wave, Scheme scheme, double tolerance) {
    SystemOptions options;
    options.grid_tolerance = tolerance;
    return {mesh, wave, scheme, options};
  }
  Eigen::MatrixXcf product(cuda::Boundary& boundary, bool transposed, const Eigen::MatrixXcf& x) {
    GpuBlock there(context(), x);
    GpuBlock y(context(), x.rows(), x.cols());
    boundary.apply(transposed, there.data(), y.data(), static_cast<int>(x.cols()), 0);
    return y.get();
  }
};

struct EquationCase {
  cuda::Equation equation;
  Scheme scheme;
};

// Of paper_corrected the processor has the diagonal by the grid too, the card that of direct sums.
constexpr EquationCase kEquations[] = {{cuda::Equation::kPaper, Scheme::kPaper},
                                       {cuda::Equation::kBurtonMiller, Scheme::kBurtonMiller}};

// What the card makes of a grid is what the processor does, but for roundings: the error of the grid itself is common.
TEST_F(GpuGridSums, ProductsAreTheCpus) {
  for (const auto& [name, mesh] : surfaces()) {
    for (const double absorption : {0.0, 3.0}) {
      const Wave wave = wave_of(absorption);
      const cuda::Faces faces = faces_of(context(), mesh, wave);
      for (const double tolerance : {1e-3, 1e-5}) {
        for (const EquationCase& given : kEquations) {
          const ScatteringSystem reference = system(mesh, wave, given.scheme, tolerance);
          cuda::GridSums sums(faces, card_grid(grid_body(mesh), mesh.centroids().rowwise().minCoeff(), reference));
          cuda::Boundary boundary(faces, given.equation);
          boundary.go_through(&sums);
          for (const int columns : {1, 6}) {
            const Eigen::MatrixXcf x = random_block(mesh.face_count(), columns);
            for (const bool transposed : {false, true}) {
              const auto& by_grid = reference.by_grid();
              const Eigen::MatrixXcd wide = x.cast<Complex>();
              const Eigen::MatrixXcd expected = transposed ? by_grid.apply_transpose(wide) : by_grid.apply(wide);
              const Eigen::MatrixXcf found = product(boundary, transposed, x);
              const double size = std::max(expected.norm(), wide.norm());
              EXPECT_LT((found.cast<Complex>() - expected).norm() / size, 3e-6)
                  << name << absorption << ' ' << tolerance << ' ' << to_string(given.scheme) << columns << transposed;
              EXPECT_EQ(found, product(boundary, transposed, x)) << name << ": not to the last bit";
            }
          }
        }
      }
    }
  }
}

TEST_F(GpuGridSums, SolutionsAreTheCpus) {
  HandOptions hand_options;
  hand_options.edge = 3.2e-3;
  const TriangleMesh mesh = hand(hand_options).mesh;
  const TriangleMesh moved(mesh.vertices().colwise() + Vector3(3e-3, -2e-3, 1e-3), mesh.triangles());
  ArrayLayout layout = transformed(grid_layout(6, 6, 10.16e-3), Eigen::Matrix3d::Identity(), Vector3(0, 0.05, -0.15));
  const TransducerArray sources = make_array(layout, Directivity::t4010a1(), 1.0, kAutd3SourceStrength);
  const Eigen::MatrixXcd drives = random_block(sources.size(), 3).cast<Complex>();
  for (const Scheme scheme : {Scheme::kBurtonMiller, Scheme::kBurtonMillerPolished}) {
    const ScatteringSystem reference = system(mesh, wave_of(0.0), scheme, 1e-5);
    SolverOptions options;
    options.kind = SolverKind::kFft;
    BodyOnCard card(shared_gpu(0), reference, options, false);
    const auto expect_solved = [&](const ScatteringSystem& of) {
      const Solved solved = card.pressure(sources, drives);
      EXPECT_EQ(card.kind(), SolverKind::kFft);
      EXPECT_TRUE(solved.report.converged);
      SolverOptions exact;
      exact.tolerance = 1e-6;
      const IncidentField field = of.incident(sources, drives);
      const Eigen::MatrixXcd expected = of.pressure(make_solver(of, exact)->solve(of.right_hand_side(field)).x, field);
      EXPECT_LT((solved.x - expected).norm() / expected.norm(), 4e-4) << to_string(scheme);
    };
    expect_solved(reference);
    card.move(moved);
    expect_solved(system(moved, wave_of(0.0), scheme, 0.0));
  }
}

TEST_F(GpuGridSums, FramesTakeNoMoreMemory) {
  const TriangleMesh mesh = gpu_mesh(icosphere(8e-3, 6), 1.0);
  const ScatteringSystem reference = system(mesh, wave_of(0.0), Scheme::kBurtonMiller, 1e-5);
  const Eigen::MatrixXcf x = random_block(mesh.face_count(), 2);
  const cuda::Faces faces = faces_of(context(), mesh, wave_of(0.0));
  cuda::Boundary boundary(faces, cuda::Equation::kBurtonMiller);
  const std::size_t taken = gpu().taken();
  for (int frame = 0; frame < 10; ++frame) {
    cuda::GridSums sums(faces, card_grid(grid_body(mesh), mesh.centroids().rowwise().minCoeff(), reference));
    boundary.go_through(&sums);
    product(boundary, false, x);
  }
  boundary.go_through(nullptr);
  EXPECT_EQ(gpu().taken(), taken);
}

}  // namespace gpu_grid_test
}  // namespace touchfield
