#include <iterator>

#include <gtest/gtest.h>

#include "sim/bem/boundary_operator.h"
#include "sim/bem/layer_sum.h"
#include "sim/gpu/cuda/boundary.cuh"
#include "tests/gpu/surface_support.h"

namespace touchfield {
namespace gpu_near_test {

using GpuNear = CardTest;

template <typename T>
std::vector<T> downloaded(const cuda::Array<T>& there) {
  std::vector<T> values(there.size());
  there.download(values.data(), values.size());
  return values;
}

Eigen::MatrixXcd dense(const NearCorrections& near) {
  Eigen::MatrixXcd matrix = Eigen::MatrixXcd::Zero(near.size(), near.size());
  near.add_to<double>(1.0, matrix);
  return matrix;
}

/// The faces near to each row but itself, by the CPU's loops.
std::vector<int> near_faces(const TriangleMesh& mesh, Eigen::Index row) {
  const FaceArrays<double> faces(mesh);
  const Eigen::VectorXd reach_squared = 64.0 * mesh.areas();
  std::vector<int> near(static_cast<std::size_t>(faces.size()));
  const int found = pair_loops().near_sources(faces.point(row), faces.sources(), reach_squared.data(),
                                              static_cast<int>(faces.size()), near.data());
  near.resize(static_cast<std::size_t>(found));
  near.erase(std::remove(near.begin(), near.end(), static_cast<int>(row)), near.end());
  return near;
}

TEST_F(GpuNear, PairsAreTheCpusAndValuesToo) {
  for (const auto& [name, mesh] : gpu_surfaces()) {
    for (const Complex& wavenumber : {kGpuWavenumber, kGpuDamped}) {
      const cuda::Faces faces = gpu_faces(context(), mesh, wavenumber);
      const cuda::NearCorrections near(faces, {});
      const NearCorrections reference(mesh, wavenumber, kGpuGamma, Layer::kBurtonMiller, {});
      const Eigen::MatrixXcd expected = dense(reference);
      ASSERT_EQ(static_cast<std::size_t>(near.pairs()), reference.pairs()) << name;
      const std::vector<int> starts = downloaded(near.starts());
      const std::vector<int> columns = downloaded(near.columns());
      const std::vector<cuComplex> values = downloaded(near.values());
      ASSERT_EQ(starts.back(), near.pairs());
      for (Eigen::Index i = 0; i < mesh.face_count(); ++i) {
        const auto row = static_cast<std::size_t>(i);
        ASSERT_EQ(std::vector<int>(columns.begin() + starts[row], columns.begin() + starts[row + 1]),
                  near_faces(mesh, i))
            << name << i;
        const double largest = expected.row(i).cwiseAbs().maxCoeff();
        for (int p = starts[row]; p < starts[row + 1]; ++p) {
          const auto at = static_cast<std::size_t>(p);
          const Complex found(values[at].x, values[at].y);
          ASSERT_LT(std::abs(found - expected(i, columns[at])), 2e-5 * largest) << name << i << "," << columns[at];
        }
      }
    }
  }
}

TEST_F(GpuNear, ProductsAndRowsAreTheCpus) {
  const TriangleMesh mesh = gpu_mesh(gpu_gap(), 1.0);
  const Eigen::Index m = mesh.face_count();
  const cuda::Faces faces = gpu_faces(context(), mesh, kGpuWavenumber);
  cuda::NearCorrections near(faces, {});
  const Eigen::MatrixXcd matrix =
      dense(NearCorrections(mesh, kGpuWavenumber, kGpuGamma, Layer::kBurtonMiller, FaceRule{}));
  std::srand(1);
  const Eigen::MatrixXcf x = Eigen::MatrixXcf::Random(m, 3);
  const Eigen::MatrixXcf before = Eigen::MatrixXcf::Random(m, 3);
  const Eigen::MatrixXcd start = before.cast<Complex>();
  GpuBlock there(context(), x);
  GpuBlock plain(context(), before);
  near.subtract_product(false, there.data(), plain.data(), 3);
  EXPECT_LT(block_error(plain.get(), start - matrix * x.cast<Complex>()), 5e-6);
  GpuBlock transposed(context(), before);
  near.subtract_product(true, there.data(), transposed.data(), 3);
  EXPECT_LT(block_error(transposed.get(), start - matrix.transpose() * x.cast<Complex>()), 5e-6);

  const Eigen::Index rows = 77;
  const Eigen::MatrixXcf panel = Eigen::MatrixXcf::Random(rows + 5, m);
  GpuBlock some(context(), panel);
  near.subtract_rows({31, static_cast<int>(rows)}, some.data(), static_cast<int>(rows) + 5);
  Eigen::MatrixXcd expected = panel.cast<Complex>();
  expected.topRows(rows) -= matrix.middleRows(31, rows);
  EXPECT_LT(block_error(some.get(), expected), 5e-6);
  EXPECT_EQ(some.get().bottomRows(5), panel.bottomRows(5));
}

}  // namespace gpu_near_test
}  // namespace touchfield
