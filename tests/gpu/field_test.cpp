#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/gpu/on_card.h"
#include "tests/gpu/channel_support.h"
#include "tests/gpu/surface_support.h"
#include "tests/support/far_field.h"

namespace touchfield {
namespace gpu_field_test {

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
