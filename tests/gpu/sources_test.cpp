#include "sim/gpu/cuda/sources.cuh"

#include <cmath>

#include <gtest/gtest.h>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/layer_sum.h"
#include "sim/gpu/cuda/sums.cuh"
#include "tests/gpu/channel_support.h"
#include "tests/gpu/surface_support.h"

namespace touchfield {
namespace gpu_sources_test {

using GpuSources = CardTest;

TEST_F(GpuSources, PressuresAndSlopesAreTheCpus) {
  const TriangleMesh mesh = gpu_mesh(icosphere(8e-3, 6), 1.0);
  const cuda::Faces faces = gpu_faces(context(), mesh, kGpuWavenumber);
  for (const GpuChannelCase& given : gpu_channel_cases()) {
    const TransducerArray& array = given.array;
    const Eigen::Index n = array.size();
    const Eigen::VectorXcd response =
        array.response.as_designed() ? Eigen::VectorXcd() : Eigen::VectorXcd(factors(array.response));
    const cuda::Sources sources(context(), gpu_channel_wave(array, given.wave), static_cast<int>(n),
                                array.positions.data(), array.axes.data(), array.amplitudes.data(),
                                response.size() > 0 ? response.data() : nullptr);
    const Eigen::MatrixXcd pressure = incident_matrix(array, given.wave, mesh.centroids());
    const Eigen::MatrixXcd slope = incident_derivative_matrix(array, given.wave, mesh.centroids(), mesh.normals());
    for (const double* directions : {static_cast<const double*>(nullptr), faces.normals()}) {
      const Eigen::MatrixXcd& expected = directions != nullptr ? slope : pressure;
      GpuBlock single(context(), faces.size(), n);
      sources.incident(faces.centroids(), directions, faces.size(), single.data());
      EXPECT_LT(row_error(single.get(), expected), 1e-6) << given.name;
      cuda::Array<cuDoubleComplex> there(context(), static_cast<std::size_t>(expected.size()));
      sources.incident(faces.centroids(), directions, faces.size(), there.data());
      Eigen::MatrixXcd found(expected.rows(), expected.cols());
      there.download(reinterpret_cast<cuDoubleComplex*>(found.data()), there.size());
      EXPECT_LT((found - expected).norm(), 1e-9 * expected.norm()) << given.name;
    }
  }
}

TEST_F(GpuSources, SumsOffTheSkinAreTheCpus) {
  const TriangleMesh mesh = gpu_mesh(icosphere(8e-3, 6), 1.0);
  std::srand(2);
  for (const Complex& wavenumber : {kGpuWavenumber, kGpuDamped}) {
    const cuda::Faces faces = gpu_faces(context(), mesh, wavenumber);
    const LayerSum<double> sum(mesh, wavenumber, 0.0);
    for (const Eigen::Index count : {1, 333, 5000}) {  // the last are two panels
      const Points points = (0.05 * Points::Random(3, count)).colwise() + Vector3(0.11, -0.07, 0.27);
      const Eigen::MatrixXcd rows = sum.rows(Layer::kDouble, points);
      cuda::Array<double> there(context());
      there.upload(points.data(), static_cast<std::size_t>(points.size()));
      for (const int columns : {1, 3, 9}) {
        const Eigen::MatrixXcf pressures = Eigen::MatrixXcf::Random(mesh.face_count(), columns);
        GpuBlock given(context(), pressures);
        const Eigen::MatrixXcd expected = rows * pressures.cast<Complex>();
        for (const auto differences : {cuda::Differences::kDouble, cuda::Differences::kSingle}) {
          GpuBlock values(context(), count, columns);
          cuda::layer_at_points(faces, differences, there.data(), static_cast<int>(count), given.data(), columns,
                                values.data());
          const double error = differences == cuda::Differences::kDouble ? 2e-6 : 1e-5;
          EXPECT_LT(block_error(values.get(), expected), error) << count << "," << columns;
        }
      }
    }
  }
}

}  // namespace gpu_sources_test
}  // namespace touchfield
