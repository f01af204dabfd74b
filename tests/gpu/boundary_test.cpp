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

TEST_F(GpuBoundary, FacesAreTheMeshsToTheLastBit) {
  for (const auto& [name, mesh] : gpu_surfaces()) {
    const cuda::Faces faces = gpu_faces(context(), mesh, kGpuWavenumber);
    const Eigen::Index m = mesh.face_count();
    const auto centroids = values_at(context(), faces.centroids(), 3 * m);
    const auto normals = values_at(context(), faces.normals(), 3 * m);
    const auto areas = values_at(context(), faces.view().area, m);
    EXPECT_EQ(Points(Eigen::Map<const Points>(centroids.data(), 3, m)), mesh.centroids()) << name;
    EXPECT_EQ(Points(Eigen::Map<const Points>(normals.data(), 3, m)), mesh.normals()) << name;
    EXPECT_EQ(Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(areas.data(), m)), mesh.areas()) << name;
  }
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

TEST_F(GpuBoundary, RowsAreThoseOfTheStoredMatrix) {
  const TriangleMesh mesh = gpu_mesh(gpu_gap(), 1.0);
  const auto m = static_cast<int>(mesh.face_count());
  const cuda::Faces faces = faces_of(context(), mesh, wave_of(0.0));
  for (const EquationCase& given : kEquations) {
    cuda::Boundary boundary(faces, given.equation);
    boundary.store();
    const Eigen::MatrixXcf matrix = stored(context(), boundary);
    const Eigen::MatrixXcf before = random_block(103, m);
    GpuBlock rows(context(), before);
    boundary.fill_rows({37, 101}, rows.data(), 103);
    EXPECT_EQ(rows.get().topRows(101), matrix.middleRows(37, 101));
    EXPECT_EQ(rows.get().bottomRows(2), before.bottomRows(2));
  }
}

TEST_F(GpuBoundary, AMovedSurfaceIsAnewOne) {
  const TriangleMesh mesh = gpu_mesh(icosphere(8e-3, 6), 1.0);
  Points elsewhere = mesh.vertices();
  elsewhere.row(0) *= 1.3;
  elsewhere.row(2).array() += 0.02 + 0.1 * elsewhere.row(1).array();
  const TriangleMesh changed(elsewhere, mesh.triangles());
  const Eigen::MatrixXcf x = random_block(mesh.face_count(), 2);
  for (const EquationCase& given : kEquations) {
    cuda::Faces faces = faces_of(context(), mesh, wave_of(0.0));
    cuda::Boundary boundary(faces, given.equation);
    boundary.store();
    const Eigen::MatrixXcf before = stored(context(), boundary);
    product(context(), boundary, true, x);
    faces.move(elsewhere.data());
    boundary.update();
    const cuda::Faces other_faces = faces_of(context(), changed, wave_of(0.0));
    cuda::Boundary other(other_faces, given.equation);
    other.store();
    EXPECT_EQ(stored(context(), boundary), stored(context(), other));
    EXPECT_NE(stored(context(), boundary), before);
    boundary.forget();
    other.forget();
    for (const bool transposed : {false, true}) {
      EXPECT_EQ(product(context(), boundary, transposed, x), product(context(), other, transposed, x));
    }
    faces.move(mesh.vertices().data());
    boundary.update();
    boundary.store();
    EXPECT_EQ(stored(context(), boundary), before);
  }
}

TEST_F(GpuBoundary, PanelsShrinkWhereMemoryIsShort) {
  const TriangleMesh mesh = gpu_mesh(gpu_gap(), 1.0);
  const Eigen::MatrixXcf x = random_block(mesh.face_count(), 8);
  const auto panel = static_cast<std::size_t>(mesh.face_count()) * sizeof(cuComplex) * 1280;
  std::size_t needed = 0;
  Eigen::MatrixXcf expected;
  {
    const auto open = open_gpu(0);
    auto& whole = dynamic_cast<cuda::Context&>(*open);
    const cuda::Faces faces = faces_of(whole, mesh, wave_of(0.0));
    cuda::Boundary boundary(faces, cuda::Equation::kBurtonMiller);
    needed = open->taken();
    expected = product(whole, boundary, false, x);
    EXPECT_GE(open->taken(), needed + panel);
  }
  GpuLimits limits;
  limits.memory = needed + panel / 3;
  const auto open = open_gpu(0, limits);
  auto& short_of = dynamic_cast<cuda::Context&>(*open);
  const cuda::Faces faces = faces_of(short_of, mesh, wave_of(0.0));
  cuda::Boundary boundary(faces, cuda::Equation::kBurtonMiller);
  EXPECT_LT(block_error(product(short_of, boundary, false, x), expected.cast<Complex>()), 1e-6);
  EXPECT_THROW(boundary.store(), GpuMemoryFailure);
  EXPECT_FALSE(boundary.is_stored());
}

TEST_F(GpuBoundary, AFailureAnywhereIsSaid) {
  const TriangleMesh mesh = icosphere(8e-3, 3);
  const Eigen::MatrixXcf x = random_block(mesh.face_count(), 1);
  int calls = 0;
  for (bool failed = true; failed; ++calls) {
    ASSERT_LT(calls, 100);
    GpuLimits limits;
    limits.fail_after = calls;
    const auto broken = open_gpu(0, limits);
    auto& there = dynamic_cast<cuda::Context&>(*broken);
    try {
      const cuda::Faces faces = faces_of(there, mesh, wave_of(0.0));
      cuda::Boundary boundary(faces, cuda::Equation::kBurtonMiller);
      product(there, boundary, true, x);
      failed = false;
    } catch (const GpuFailure&) {
    }
    EXPECT_EQ(broken->taken(), 0U);
  }
  EXPECT_GT(calls, 10);
}

}  // namespace gpu_boundary_test
}  // namespace touchfield
