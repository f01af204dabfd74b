#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sim/acoustics/incident_field.h"
#include "sim/core/errors.h"
#include "sim/gpu/cuda/sources.cuh"
#include "sim/gpu/on_card.h"
#include "tests/gpu/surface_support.h"
#include "tests/support/far_field.h"

namespace touchfield {
namespace gpu_field_test {

/// Arrays of every kind.
struct GpuChannelCase {
  std::string name;
  TransducerArray array;
  Wave wave;
};

std::vector<GpuChannelCase> gpu_channel_cases() {
  const Wave plain(air(293.15), 40e3);
  Medium damped_air = air(293.15);
  damped_air.absorption = 3.0;
  const Wave damped(damped_air, 40e3);
  const ArrayLayout layout = grid_layout(5, 4, kAutd3Pitch);
  const auto with = [&](const Directivity& directivity) {
    return make_array(layout, directivity, 1.0, kAutd3SourceStrength);
  };
  TransducerArray uneven = with(Directivity::t4010a1());
  uneven.response = random_response(uneven.size(), {.phase = 0.5, .gain = 0.1, .dead = 0.1}, 4);
  const TransducerArray flat = plane_wave(Vector3(0.6, 0.0, 0.8), 2.0);
  return {{"omni", with(Directivity::omni()), plain},
          {"spline", with(Directivity::t4010a1()), plain},
          {"spline damped", with(Directivity::t4010a1()), damped},
          {"piston", with(Directivity::piston(plain.k(), 4.5e-3)), plain},
          {"response", uneven, damped},
          {"plane", flat, plain},
          {"plane damped", flat, damped}};
}

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

/// A field to compute: a body 0.2 m above an array.
struct Asked {
  TriangleMesh mesh;
  GpuChannelCase channels;
  Eigen::MatrixXcd drive = support::many_drives(channels.array.size(), 6);
  Eigen::MatrixXcd surface = support::skin_pressures(mesh, channels.array, channels.wave, drive);
  Points points = support::points_about(mesh, 9);

  FarField by(Gpu& gpu) const {
    return far_field_on_card(gpu, kFarDistance, mesh, channels.array, channels.wave, points, surface, drive);
  }
};

Asked small() { return {gpu_mesh(icosphere(8e-3, 6), 1.0), gpu_channel_cases()[1]}; }

double largest_difference(const Eigen::MatrixXcd& found, const Eigen::MatrixXcd& expected) {
  return (found - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

class GpuFieldTest : public CardTest {
 protected:
  /// What a card of so little memory makes of small().
  static FarField with_memory(std::size_t bytes) {
    GpuLimits limits;
    limits.memory = bytes;
    const auto capped = open_gpu(0, limits);
    FarField far = small().by(*capped);
    EXPECT_EQ(capped->taken(), 0U);
    EXPECT_LE(capped->most_taken(), bytes);
    return far;
  }
};

TEST_F(GpuFieldTest, IsTheProcessors) {
  for (const auto& [name, mesh] : gpu_surfaces()) {
    for (const GpuChannelCase& channels : gpu_channel_cases()) {
      const Asked asked{mesh, channels};
      const auto& [array, wave] = std::tie(channels.array, channels.wave);
      const FarField sums = support::reference_far_field(mesh, array, wave, asked.points, asked.surface, asked.drive);
      const FieldValues expected =
          with_near_faces(mesh, wave, asked.points, asked.surface, sums.pressure, sums.winding, sums.near);
      FarField far = asked.by(gpu());
      const FieldValues found =
          with_near_faces(mesh, wave, asked.points, asked.surface, far.pressure, far.winding, far.near);
      EXPECT_EQ(found.inside, expected.inside) << name << ", " << channels.name;
      EXPECT_LT(largest_difference(found.pressure, expected.pressure), 1e-6) << name << ", " << channels.name;
    }
  }
}

TEST_F(GpuFieldTest, LeavesOutTheSameFaces) {
  for (const auto& [name, mesh] : gpu_surfaces()) {
    const Asked asked{mesh, gpu_channel_cases()[1]};
    const FarField expected = support::reference_far_field(mesh, asked.channels.array, asked.channels.wave,
                                                           asked.points, asked.surface, asked.drive);
    const FarField found = asked.by(gpu());
    EXPECT_EQ(found.near, expected.near) << name;
    EXPECT_LT((found.winding - expected.winding).cwiseAbs().maxCoeff(), 1e-6) << name;
    EXPECT_LT(largest_difference(found.pressure, expected.pressure), 1e-6) << name;
    const FarField again = asked.by(gpu());
    EXPECT_EQ(again.pressure, found.pressure) << name << ": not to the last bit";
    EXPECT_EQ(again.winding, found.winding) << name << ": not to the last bit";
  }
}

TEST_F(GpuFieldTest, GoesInPartsWhereMemoryIsShort) {
  const FarField whole = small().by(gpu());
  const FarField parts = with_memory(std::size_t{8} << 20U);  // some 350 points of 1,209
  EXPECT_EQ(parts.near, whole.near);
  EXPECT_EQ(parts.winding, whole.winding);
  EXPECT_LT(largest_difference(parts.pressure, whole.pressure), 1e-12);
}

TEST_F(GpuFieldTest, SaysWhereThereIsNoRoom) { EXPECT_THROW(with_memory(std::size_t{1} << 20U), GpuMemoryFailure); }

TEST_F(GpuFieldTest, FailsWhereTheCardDoes) {
  for (int calls = 0; calls < 5; ++calls) {
    GpuLimits limits;
    limits.fail_after = calls;
    const auto broken = open_gpu(0, limits);
    EXPECT_THROW(small().by(*broken), DeviceError) << calls;
    EXPECT_EQ(broken->taken(), 0U) << calls;
  }
}

}  // namespace gpu_field_test
}  // namespace touchfield
