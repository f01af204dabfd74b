#include <random>

#include "hardware/links/autd3_udp_link.h"
#include "tests/support/random_support.h"
#include "tests/support/testing.h"

namespace touchfield::autd3_units_test {

TEST(Autd3Units, AreFoundInALayoutAsTheyWerePlaced) {
  std::mt19937 random(1);
  std::vector<UnitPlacement> units(6);
  for (UnitPlacement& unit : units) unit = {point_in_cube(random), some_rotation(random)};
  const std::vector<UnitPlacement> found = autd3_placements(autd3_layout(units));
  ASSERT_EQ(found.size(), units.size());
  for (std::size_t u = 0; u < units.size(); ++u) {
    EXPECT_LT((found[u].position - units[u].position).norm(), 1e-12);
    EXPECT_LT((found[u].rotation - units[u].rotation).norm(), 1e-12);
  }
}

TEST(Autd3Units, AreFoundInAnyOrder) {
  const ArrayLayout tiles = autd3_tiles(2, 3, kAutd3Pitch);
  ArrayLayout reversed = tiles;
  reversed.positions = tiles.positions.rowwise().reverse();
  reversed.device = tiles.device.reverse();
  reversed.channel = tiles.channel.reverse();
  const std::vector<UnitPlacement> found = autd3_placements(reversed);
  ASSERT_EQ(found.size(), 6U);
  EXPECT_LT((autd3_layout(found).positions - tiles.positions).colwise().norm().maxCoeff(), 1e-12);
}

TEST(Autd3Units, WhatIsNoneIsRefused) {
  const ArrayLayout tiles = autd3_tiles(2, 1, kAutd3Pitch);
  const auto message = [&](const auto& change) {
    ArrayLayout changed = tiles;
    change(changed);
    return message_of<InputError>([&] { autd3_placements(changed); });
  };
  EXPECT_THAT(message_of<InputError>([] { autd3_placements(sonicsurface_layout()); }), HasSubstr("256"));
  EXPECT_THAT(message_of<InputError>([] { autd3_placements(autd3_unit(10e-3)); }), HasSubstr("unit 0"));
  // Mirrored in x: every distance is right, but the axes point the other way.
  EXPECT_THAT(message([](ArrayLayout& l) { l.positions.row(0) *= -1; }), HasSubstr("emits along"));
  EXPECT_THAT(message([](ArrayLayout& l) { l.axes.col(300).z() = -1; }), HasSubstr("transducer 51 emits"));
  EXPECT_THAT(message([](ArrayLayout& l) { l.positions(2, 300) += 2e-6; }), HasSubstr("unit 1: its transducer 51"));
  EXPECT_THAT(message([](ArrayLayout& l) { l.channel(7) = 8; }), HasSubstr("both channel 8"));
  EXPECT_THAT(message([](ArrayLayout& l) { l.device(7) = 2; }), HasSubstr("device 2"));
  EXPECT_THAT(message([](ArrayLayout& l) { l.channel(7) = 249; }), HasSubstr("channel 249"));
  ArrayLayout nearly = tiles;
  nearly.positions(2, 300) += 0.5e-6;
  EXPECT_EQ(autd3_placements(nearly).size(), 2U);
}

}  // namespace touchfield::autd3_units_test
