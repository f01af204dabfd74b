// What needs no library: where units sit, what is refused before a library is looked at, and files that are none.
#include "hardware/links/autd3_units.h"

#include <cmath>
#include <dlfcn.h>
#include <fstream>

#include "tests/hardware/autd3_support.h"
#include "tests/support/testing.h"

namespace touchfield::autd3_units_test {

TEST(Autd3Library, NamesTheFileThatIsNoLibrary) {
  const TemporaryDirectory folder;
  const std::string missing = folder.file("libautd3capi.so");
  EXPECT_THAT(message_of<InputError>([] { Autd3Library(""); }), HasSubstr("no library is named"));
  EXPECT_THAT(message_of<InputError>([&] { Autd3Library{missing}; }), HasSubstr(missing));
  EXPECT_THAT(message_of<InputError>([&] { Autd3Library{folder.path().string()}; }),
              AllOf(HasSubstr(folder.path().string()), HasSubstr("holds no libautd3capi.so")));
  std::ofstream(missing) << "not a library, but long enough to be looked at as one: " << std::string(4096, '.');
  EXPECT_THAT(message_of<InputError>([&] { Autd3Library{missing}; }),
              AllOf(HasSubstr("cannot load"), HasSubstr(missing)));
  // By its folder the same file is found.
  EXPECT_THAT(message_of<InputError>([&] { Autd3Library{folder.path().string()}; }), HasSubstr(missing));
}

TEST(Autd3Library, NamesTheSymbolThatAForeignLibraryLacks) {
  Dl_info where{};
  ASSERT_NE(dladdr(reinterpret_cast<void*>(static_cast<double (*)(double)>(std::sin)), &where), 0);
  ASSERT_NE(std::string(where.dli_fname).find(".so"), std::string::npos) << "the mathematical library is not shared";
  EXPECT_THAT(message_of<InputError>([&] { Autd3Library{where.dli_fname}; }),
              AllOf(HasSubstr(where.dli_fname), HasSubstr("AUTDGetErr")));
}

TEST(Autd3Options, AreCheckedBeforeTheLibrary) {
  const auto message = [](const auto& change) {
    Autd3Options options{.library = "/nowhere", .mode = "audit", .host = "", .units = {UnitPlacement{}}};
    change(options);
    return message_of<InputError>([&] { std::make_unique<Autd3Link>(options); });
  };
  EXPECT_THAT(message([](Autd3Options& o) { o.mode = "ethernet"; }), HasSubstr("ethernet"));
  EXPECT_THAT(message([](Autd3Options& o) { o.units.clear(); }), HasSubstr("0 units"));
  EXPECT_THAT(message([](Autd3Options& o) { o.units[0].rotation(0, 0) = -1; }), HasSubstr("rotation"));
  EXPECT_THAT(message([](Autd3Options& o) { o.units[0].position.x() = NAN; }), HasSubstr("not finite"));
  EXPECT_THAT(message([](Autd3Options& o) { o.mode = "remote"; }), HasSubstr("host"));
  EXPECT_THAT(message([](Autd3Options& o) { (o.mode = "remote", o.host = "here", o.port = 65536); }),
              HasSubstr("65536"));
  EXPECT_THAT(message([](Autd3Options& o) { (o.mode = "nop", o.break_after = 1); }), HasSubstr("audit"));
  EXPECT_THAT(message([](Autd3Options&) {}), HasSubstr("/nowhere"));
}

TEST(Autd3Units, AreFoundInALayoutAsTheyWerePlaced) {
  std::mt19937 random(1);
  const std::vector<UnitPlacement> units = random_units(random);
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
