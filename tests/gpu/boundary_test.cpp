#include "sim/gpu/cuda/boundary.cuh"

#include <gtest/gtest.h>

#include "sim/bem/scattering_system.h"
#include "tests/gpu/surface_support.h"

namespace touchfield {
namespace gpu_boundary_test {

using GpuBoundary = CardTest;

struct EquationCase {
  cuda::Equation equation;
  Scheme scheme;
};

constexpr EquationCase kEquations[] = {{cuda::Equation::kPaper, Scheme::kPaper},
                                       {cuda::Equation::kPaperCorrected, Scheme::kPaperCorrected},
                                       {cuda::Equation::kBurtonMiller, Scheme::kBurtonMiller}};

Eigen::MatrixXcf product(cuda::Context& context, cuda::Boundary& boundary, bool transposed, const Eigen::MatrixXcf& x,
                         int rough = 0) {
  GpuBlock there(context, x);
  GpuBlock y(context, x.rows(), x.cols());
  boundary.apply(transposed, there.data(), y.data(), static_cast<int>(x.cols()), rough);
  return y.get();
}

Eigen::MatrixXcf stored(cuda::Context& context, const cuda::Boundary& boundary) {
  Eigen::MatrixXcf matrix(boundary.size(), boundary.size());
  context.synchronize();
  cuda::check(cudaMemcpy(matrix.data(), boundary.stored(), static_cast<std::size_t>(matrix.size()) * sizeof(cuComplex),
                         cudaMemcpyDeviceToHost),
              "test");
  return matrix;
}

template <typename T>
std::vector<T> values_at(cuda::Context& context, const T* there, Eigen::Index count) {
  std::vector<T> values(static_cast<std::size_t>(count));
  context.synchronize();
  cuda::check(cudaMemcpy(values.data(), there, values.size() * sizeof(T), cudaMemcpyDeviceToHost), "test");
  return values;
}

TEST_F(GpuBoundary, EntriesAndDiagonalsAreTheCpus) {
  for (const auto& [name, mesh] : gpu_surfaces()) {
    for (const double absorption : {0.0, 3.0}) {
      const Wave wave = wave_of(absorption);
      const cuda::Faces faces = faces_of(context(), mesh, wave);
      for (const EquationCase& given : kEquations) {
        const ScatteringSystem system(mesh, wave, given.scheme);
        const Eigen::MatrixXcd expected = system.dense();
        cuda::Boundary boundary(faces, given.equation);
        EXPECT_EQ(static_cast<std::size_t>(boundary.near_pairs()), system.near_pairs());
        boundary.store();
        EXPECT_LT(row_error(stored(context(), boundary), expected), 3e-6) << name << absorption;
        const auto diagonal = values_at(context(), boundary.diagonal(), mesh.face_count());
        for (Eigen::Index i = 0; i < mesh.face_count(); ++i) {
          const cuDoubleComplex d = diagonal[static_cast<std::size_t>(i)];
          ASSERT_LT(std::abs(Complex(d.x, d.y) - expected(i, i)), 1e-10 * std::abs(expected(i, i))) << name << i;
        }
      }
    }
  }
}

TEST_F(GpuBoundary, ProductsAreTheCpusStoredOrNot) {
  for (const auto& [name, mesh] : gpu_surfaces()) {
    const Wave wave = wave_of(name == "gap" ? 3.0 : 0.0);
    const cuda::Faces faces = faces_of(context(), mesh, wave);
    for (const EquationCase& given : kEquations) {
      const ScatteringSystem system(mesh, wave, given.scheme);
      cuda::BoundaryOptions options;
      options.panel_bytes = static_cast<std::size_t>(mesh.face_count()) * 8 * 300;  // 256 rows, the last panel shorter
      cuda::Boundary boundary(faces, given.equation, options);
      for (const int columns : {1, 3, 4, 5, 17}) {
        const Eigen::MatrixXcf x = random_block(mesh.face_count(), columns);
        const Eigen::MatrixXcd plain = system.exact().apply(x.cast<Complex>());
        const Eigen::MatrixXcd transposed = system.exact().apply_transpose(x.cast<Complex>());
        EXPECT_LT(block_error(product(context(), boundary, false, x), plain), 2e-6) << name << columns;
        EXPECT_LT(block_error(product(context(), boundary, true, x), transposed), 2e-6) << name << columns;
        const int half = columns / 2;
        const auto expect_halves = [&](bool is_transposed, const Eigen::MatrixXcd& expected) {
          const Eigen::MatrixXcf y = product(context(), boundary, is_transposed, x, half);
          EXPECT_LT(block_error(y.rightCols(columns - half), expected.rightCols(columns - half)), 2e-6)
              << name << columns;
          if (half > 0) {
            EXPECT_LT(block_error(y.leftCols(half), expected.leftCols(half)), 2e-3) << name << columns;
          }
        };
        expect_halves(false, plain);
        expect_halves(true, transposed);
        boundary.store();
        EXPECT_TRUE(boundary.is_stored());
        EXPECT_LT(block_error(product(context(), boundary, false, x), plain), 2e-6) << name << columns;
        EXPECT_LT(block_error(product(context(), boundary, true, x), transposed), 2e-6) << name << columns;
        EXPECT_LT(block_error(product(context(), boundary, true, x, columns), transposed), 2e-3) << name << columns;
        expect_halves(false, plain);
        boundary.forget();
        EXPECT_FALSE(boundary.is_stored());
      }
    }
  }
}

}  // namespace gpu_boundary_test
}  // namespace touchfield
