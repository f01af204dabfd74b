#include "sim/gpu/cuda/sources.cuh"

#include <gtest/gtest.h>

#include "sim/acoustics/incident_field.h"
#include "sim/gpu/on_card.h"
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
    const Eigen::VectorXcd response = factors(array.response);
    const cuda::Sources sources(context(), given.wave.k(), given.wave.wavenumber().imag(),
                                card_sources(array, response));
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

}  // namespace gpu_sources_test
}  // namespace touchfield
