#include <numeric>

#include <Eigen/Geometry>

#include "hardware/emission/emission.h"
#include "sim/core/rigid_motion.h"
#include "tests/support/testing.h"

namespace touchfield::array_match_test {

TransducerArray array_of(const ArrayLayout& layout) { return make_array(layout, Directivity::omni(), 1, 1); }

ArrayLayout moved_somewhere(const ArrayLayout& layout) {
  return transformed(layout, extrinsic_rotation({0.3, -1.1, 2.5}), {0.1, -0.2, 0.3});
}

ArrayLayout reordered(const ArrayLayout& layout, const std::vector<int>& order) {
  ArrayLayout other = layout;
  for (std::size_t n = 0; n < order.size(); ++n) {
    other.positions.col(static_cast<Eigen::Index>(n)) = layout.positions.col(order[n]);
    other.axes.col(static_cast<Eigen::Index>(n)) = layout.axes.col(order[n]);
  }
  return other;
}

void expect_refused(const ArrayLayout& run, const ArrayLayout& device, const char* says) {
  EXPECT_THAT([&] { require_match(array_of(run), device, "the board"); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("the board"), HasSubstr(says))));
}

TEST(ArrayMatch, AnArrayMovedAsAWholeIsTheSame) {
  for (const ArrayLayout& layout : {sonicsurface_layout(), autd3_tiles(3, 2, 10.16e-3), grid_layout(1, 1, 0.01),
                                    grid_layout(5, 1, 0.01), grid_layout(2, 1, 0.01)}) {
    EXPECT_NO_THROW(require_match(array_of(moved_somewhere(layout)), layout, "the board"));
    EXPECT_NO_THROW(require_match(array_of(layout), layout, "the board"));
  }
}

TEST(ArrayMatch, CountAndKind) {
  expect_refused(grid_layout(16, 15, 10.5e-3), sonicsurface_layout(), "240 transducers, the device has 256");
  EXPECT_THAT(
      [] {
        require_match(plane_wave({0, 0, 1}, 1), grid_layout(1, 1, 0.01), "the board");
      },
      ThrowsMessage<InputError>(HasSubstr("plane wave")));
}

// A tenth of a millimetre anywhere: 16 transducers at a pitch 0.01 mm too long are 0.106 mm off at the corner, at one
// 0.008 mm too long 0.085 mm.
TEST(ArrayMatch, PitchToATenthOfAMillimetre) {
  expect_refused(grid_layout(16, 16, 10.16e-3), sonicsurface_layout(), "pitch 10.160 mm, the device's is 10.500 mm");
  expect_refused(grid_layout(16, 16, 10.51e-3), sonicsurface_layout(), "other places");
  EXPECT_NO_THROW(require_match(array_of(grid_layout(16, 16, 10.508e-3)), sonicsurface_layout(), "the board"));
}

TEST(ArrayMatch, OnePlaceIsOff) {
  for (const double off : {0.05e-3, 0.2e-3}) {
    ArrayLayout run = moved_somewhere(sonicsurface_layout());
    run.positions(1, 77) += off;
    if (off < kMatchTolerance) {
      EXPECT_NO_THROW(require_match(array_of(run), sonicsurface_layout(), "the board"));
    } else {
      expect_refused(run, sonicsurface_layout(), "transducer 77 is 0.20 mm away");
    }
  }
}

TEST(ArrayMatch, Order) {
  const ArrayLayout board = sonicsurface_layout();
  std::vector<int> order(256);
  std::iota(order.begin(), order.end(), 0);
  std::swap(order[3], order[4]);
  expect_refused(reordered(board, order), board, "another order");
  for (int n = 0; n < 256; ++n) order[static_cast<std::size_t>(n)] = 16 * (n % 16) + n / 16;  // columns first: a mirror
  expect_refused(reordered(board, order), board, "mirrored");
  for (int n = 0; n < 256; ++n) order[static_cast<std::size_t>(n)] = 255 - n;  // the board turned by half
  EXPECT_NO_THROW(require_match(array_of(reordered(board, order)), board, "the board"));
}

TEST(ArrayMatch, UnitsAndChannels) {
  const ArrayLayout units = autd3_tiles(2, 1, 10.16e-3);
  ArrayLayout run = units;
  run.device(249) = 0;
  expect_refused(run, units, "transducer 249 is channel 0 of unit 0, the device's is channel 0 of unit 1");
  run = units;
  std::swap(run.channel(5), run.channel(6));
  expect_refused(run, units, "transducer 5 is channel 6");
}

TEST(ArrayMatch, Axes) {
  ArrayLayout run = sonicsurface_layout();
  run.axes.col(9) = extrinsic_rotation({0.02, 0, 0}) * run.axes.col(9);
  expect_refused(run, sonicsurface_layout(), "transducer 9");
  run = sonicsurface_layout();
  run.axes = -run.axes;  // it faces down: the places are those of the board seen in a mirror
  expect_refused(run, sonicsurface_layout(), "face another direction");
}

TEST(ArrayMatch, UnitsThatSitElsewhere) {
  const ArrayLayout unit = autd3_unit(10.16e-3);
  const ArrayLayout device = joined({unit, transformed(unit, Eigen::Matrix3d::Identity(), {0.2, 0, 0})});
  expect_refused(joined({unit, transformed(unit, extrinsic_rotation({0, 0.5, 0}), {0.2, 0, 0})}), device,
                 "other places");
}

}  // namespace touchfield::array_match_test
