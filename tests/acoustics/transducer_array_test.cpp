#include "sim/acoustics/transducer_array.h"

#include "sim/core/rigid_motion.h"
#include "sim/core/units.h"
#include "tests/support/testing.h"

namespace touchfield::transducer_array_test {

constexpr double kPitch = 10.16e-3;

TEST(TransducerArray, GridOfThePaperHas1496Transducers) {
  const ArrayLayout grid = grid_layout(44, 34, kPitch);
  EXPECT_EQ(grid.positions.cols(), 1496);
  EXPECT_LT(grid.positions.rowwise().mean().norm(), 1e-15);
  // x fastest: the second transducer is one pitch along x from the first corner.
  EXPECT_LT((grid.positions.col(0) - Vector3(-21.5 * kPitch, -16.5 * kPitch, 0)).norm(), 1e-15);
  EXPECT_LT((grid.positions.col(1) - grid.positions.col(0) - Vector3(kPitch, 0, 0)).norm(), 1e-15);
  EXPECT_EQ(grid.axes.col(7), Vector3::UnitZ());
  EXPECT_EQ(grid.channel(1495), 1495);
}

TEST(TransducerArray, Autd3UnitHas249WithHolesSkipped) {
  const ArrayLayout unit = autd3_unit(kPitch);
  ASSERT_EQ(unit.positions.cols(), 249);
  EXPECT_EQ(unit.positions.col(0), Vector3::Zero());
  // Row 0 holds 18, row 1 misses x = 1, 2, 16: numbers 18, 19, 31 are x = 0, 3 and 17 of row 1 would be 32.
  EXPECT_LT((unit.positions.col(18) - kPitch * Vector3(0, 1, 0)).norm(), 1e-15);
  EXPECT_LT((unit.positions.col(19) - kPitch * Vector3(3, 1, 0)).norm(), 1e-15);
  EXPECT_LT((unit.positions.col(31) - kPitch * Vector3(15, 1, 0)).norm(), 1e-15);
  EXPECT_LT((unit.positions.col(32) - kPitch * Vector3(17, 1, 0)).norm(), 1e-15);
  EXPECT_LT((unit.positions.col(33) - kPitch * Vector3(0, 2, 0)).norm(), 1e-15);
  EXPECT_LT((unit.positions.col(248) - kPitch * Vector3(17, 13, 0)).norm(), 1e-15);
}

TEST(TransducerArray, SixAutd3UnitsTileBoardByBoard) {
  const ArrayLayout tiles = autd3_tiles(3, 2, kPitch);
  ASSERT_EQ(tiles.positions.cols(), 1494);
  EXPECT_EQ(tiles.device(0), 0);
  EXPECT_EQ(tiles.device(249), 1);
  EXPECT_EQ(tiles.device(1493), 5);
  EXPECT_EQ(tiles.channel(1493), 248);
  EXPECT_LT((tiles.positions.col(249) - tiles.positions.col(0) - Vector3(192.0e-3, 0, 0)).norm(), 1e-15);
  EXPECT_LT((tiles.positions.col(3 * 249) - tiles.positions.col(0) - Vector3(0, 151.4e-3, 0)).norm(), 1e-15);
  // Corner transducers are never holes, so the bounding box is that of the full grids.
  EXPECT_LT((tiles.positions.rowwise().minCoeff() + tiles.positions.rowwise().maxCoeff()).norm(), 1e-15);
}

TEST(TransducerArray, SonicsurfaceIs16By16At10Point5) {
  const ArrayLayout layout = sonicsurface_layout();
  EXPECT_EQ(layout.positions.cols(), 256);
  EXPECT_NEAR(layout.positions.row(0).maxCoeff() - layout.positions.row(0).minCoeff(), 15 * 10.5e-3, 1e-15);
}

TEST(TransducerArray, MovesRigidly) {
  const ArrayLayout unit = autd3_unit(kPitch);
  const ArrayLayout tilted = transformed(unit, extrinsic_rotation({90 * kDegree, 0, 0}), {0, 0, 0.1});
  EXPECT_LT((tilted.axes.col(3) - Vector3(0, -1, 0)).norm(), 1e-15);
  EXPECT_LT((tilted.positions.col(33) - Vector3(0, 0, 0.1 + 2 * kPitch)).norm(), 1e-15);
}

TEST(TransducerArray, RefusesValuesOutOfRange) {
  EXPECT_THROW(grid_layout(0, 3, kPitch), InputError);
  EXPECT_THROW(grid_layout(3, 3, -kPitch), InputError);
  const ArrayLayout grid = grid_layout(2, 2, kPitch);
  EXPECT_THROW(make_array(grid, Directivity::omni(), 1.5, 4.0), InputError);
  EXPECT_THROW(make_array(grid, Directivity::omni(), 0.0, 4.0), InputError);
  EXPECT_THROW(make_array(grid, Directivity::omni(), 1.0, -4.0), InputError);
  EXPECT_THROW(make_array(joined({}), Directivity::omni(), 1.0, 4.0), InputError);
  EXPECT_THROW(plane_wave({0, 0, 2}, 1.0), InputError);
}

TEST(TransducerArray, LevelScalesTheSourceStrength) {
  EXPECT_DOUBLE_EQ(make_array(grid_layout(1, 1, kPitch), Directivity::omni(), 0.5, 4.386).amplitudes(0), 2.193);
}

}  // namespace touchfield::transducer_array_test
