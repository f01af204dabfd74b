#include "sim/gpu/cuda/two_level.cuh"

#include <gtest/gtest.h>

#include "sim/bem/surface_filter.h"
#include "sim/gpu/cuda/block_gmres.cuh"
#include "tests/gpu/surface_support.h"

namespace touchfield {
namespace gpu_two_level_test {

TriangleMesh index_up() {
  HandOptions options;
  options.pose = "index_up";
  options.edge = 3.2e-3;
  return hand(options).mesh;
}

class GpuTwoLevel : public CardTest {
 protected:
  template <typename Operator>
  Eigen::MatrixXcf applied(Operator& to, bool transposed, const Eigen::MatrixXcf& x) {
    GpuBlock there(context(), x);
    GpuBlock y(context(), x.rows(), x.cols());
    to.apply(transposed, there.data(), static_cast<int>(x.cols()), y.data());
    return y.get();
  }
};

TEST_F(GpuTwoLevel, TheFilterIsTheCpus) {
  for (const Complex& wavenumber : {kGpuWavenumber, kGpuDamped}) {
    for (const TriangleMesh& mesh : {gpu_gap(), index_up()}) {
      const cuda::Faces faces = gpu_faces(context(), mesh, wavenumber);
      cuda::SurfaceFilter filter(faces, 1.0);
      const SurfaceFilter expected(mesh, wavenumber, 1.0);
      EXPECT_EQ(filter.degree(), expected.degree());
      const Eigen::MatrixXcf x = random_block(mesh.face_count(), 2, 11);
      EXPECT_LT(block_error(applied(filter, false, x), expected.apply(x.cast<Complex>())), 1e-5);
      EXPECT_LT(block_error(applied(filter, true, x), expected.apply_transpose(x.cast<Complex>())), 1e-5);
    }
  }
}

TEST_F(GpuTwoLevel, FewStepsToTheSameSolution) {
  const TriangleMesh mesh = index_up();
  const int count = static_cast<int>(mesh.face_count());
  const cuda::Faces faces = gpu_faces(context(), mesh, kGpuWavenumber);
  cuda::Boundary boundary(faces, cuda::Equation::kBurtonMiller, {cuda::NearRule{}, std::size_t{1} << 30U});
  cuda::TwoLevel two_level(faces, boundary, 1.0);
  boundary.store();
  Eigen::MatrixXcf b(count, 2);  // plane waves
  for (Eigen::Index f = 0; f < count; ++f) {
    const Vector3 at = kGpuWavenumber.real() * mesh.centroids().col(f);
    const Vector3 n = mesh.normals().col(f);
    b(f, 0) = std::complex<float>(std::polar(1.0, at.z()) * Complex(1.0 - n.z(), 0.0));
    b(f, 1) = std::complex<float>(std::polar(1.0, at.x()) * Complex(1.0 - n.x(), 0.0));
  }
  GpuBlock right(context(), b);
  for (const bool transposed : {false, true}) {
    const cuda::BlockProduct apply = [&](const cuComplex* x, cuComplex* y, int columns, const double*) {
      boundary.apply(transposed, x, y, columns, 0);
    };
    const cuda::BlockPreconditioner precondition = [&](const cuComplex* x, cuComplex* y, int columns) {
      two_level.apply(transposed, x, columns, y);
    };
    GpuBlock plain(context(), count, 2);
    GpuBlock preconditioned(context(), count, 2);
    cuda::BlockGmres gmres(context());
    cuda::GmresLimits limits;
    limits.tolerance = 1e-5;
    limits.restart = 200;
    const int without = gmres.solve(apply, count, 2, right.data(), plain.data(), limits, false).steps;
    limits.tolerance = 1e-4;
    limits.weak = true;
    const cuda::GmresReport report =
        gmres.solve(apply, count, 2, right.data(), preconditioned.data(), limits, false, {}, &precondition);
    EXPECT_TRUE(report.converged);
    EXPECT_LE(report.steps, 12);
    EXPECT_GT(without, 4 * report.steps);
    EXPECT_LT(block_error(preconditioned.get(), plain.get().cast<Complex>()), 3e-4) << transposed;
  }
}

}  // namespace gpu_two_level_test
}  // namespace touchfield
