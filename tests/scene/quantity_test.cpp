#include "sim/scene/quantity.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/scene/schema_info.h"

namespace touchfield::schema {
namespace {

TEST(Decimal, ReadsWhatYamlCallsANumber) {
  EXPECT_EQ(parse_decimal("8"), 8.0);
  EXPECT_EQ(parse_decimal("-8.5"), -8.5);
  EXPECT_EQ(parse_decimal("+.5"), 0.5);
  EXPECT_EQ(parse_decimal("5."), 5.0);
  EXPECT_EQ(parse_decimal("1e3"), 1000.0);
  EXPECT_EQ(parse_decimal("1.5E-3"), 1.5e-3);
  EXPECT_EQ(parse_decimal("1e+2"), 100.0);
  EXPECT_TRUE(std::signbit(*parse_decimal("-0")));
}

TEST(Decimal, RefusesTheRest) {
  for (const char* text :
       {"",      "-",    "+",   ".",   "e5",   ".e5",  "1e", "1e+", "1e-", "1e+-5", "1e--5", "--1",  "+-1",
        "1.2.3", "0x10", "nan", "inf", ".nan", ".inf", "1 ", " 1",  "1,5", "1_000", "abc",   "1e5x", "1e5.5"}) {
    EXPECT_FALSE(parse_decimal(text)) << text;
  }
}

TEST(Decimal, OverflowsToInfinityAndUnderflowsToZero) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(parse_decimal("1e999"), kInfinity);
  EXPECT_EQ(parse_decimal("-1e99999999999999999999"), -kInfinity);
  EXPECT_EQ(parse_decimal("1" + std::string(400, '0')), kInfinity);
  EXPECT_EQ(parse_decimal("1e-999"), 0.0);
  EXPECT_EQ(parse_decimal("1e-99999999999999999999"), 0.0);
  EXPECT_EQ(parse_decimal("0." + std::string(400, '0') + "1"), 0.0);
  EXPECT_EQ(parse_decimal("0e999"), 0.0);
}

TEST(Decimal, WritesTheShortestText) {
  EXPECT_EQ(decimal_text(8), "8");
  EXPECT_EQ(decimal_text(0), "0");
  EXPECT_EQ(decimal_text(-0.0), "-0");
  EXPECT_EQ(decimal_text(-120), "-120");
  EXPECT_EQ(decimal_text(0.1 + 0.2), "0.30000000000000004");
  EXPECT_EQ(decimal_text(1e-4), "0.0001");
  EXPECT_EQ(decimal_text(1e-5), "1e-5");
  EXPECT_EQ(decimal_text(-3.5e-12), "-3.5e-12");
  EXPECT_EQ(decimal_text(1.5e-6), "1.5e-6");
  EXPECT_EQ(decimal_text(1e16), "1e16");
}

TEST(Decimal, ReadsBackEveryDouble) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 20000; ++i) {
    const auto value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) continue;
    EXPECT_EQ(std::bit_cast<std::uint64_t>(*parse_decimal(decimal_text(value))), std::bit_cast<std::uint64_t>(value))
        << decimal_text(value);
  }
}

TEST(Unit, GivesTextsBack) {
  for (const std::string text : {"0", "20", "-0.1", "21.7", "33.3", "60", "-50"}) {
    EXPECT_EQ(Unit::celsius().text(*Unit::celsius().si(text)), text);
  }
  for (const std::string text : {"0", "90", "-180", "0.1", "33.3", "359.9", "12.345678"}) {
    EXPECT_EQ(Unit::degree().text(*Unit::degree().si(text)), text);
  }
  for (const int power : {-6, -3, -2, 0, 3}) {
    for (const std::string text : {"0", "8", "-0.1", "10.16", "8.1", "25.3", "0.01016", "1234.56789", "40"}) {
      EXPECT_EQ(Unit::power_of_ten(power).text(*Unit::power_of_ten(power).si(text)), text) << power;
    }
  }
}

// One rounding of the number's text and two of its conversion: 3 halves of an ulp, each at most 2^-53.
TEST(Unit, ConvertsWithinRounding) {
  EXPECT_EQ(Unit::power_of_ten(-3).si("8"), 0.008);
  EXPECT_EQ(Unit::power_of_ten(3).si("40"), 40000.0);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> numbers(-500, 500);
  for (int i = 0; i < 20000; ++i) {
    const double number = numbers(random);
    const std::string text = decimal_text(number);
    const double exact = *parse_decimal(text + "e-3");
    EXPECT_NEAR(*Unit::power_of_ten(-3).si(text), exact, 2 * std::numeric_limits<double>::epsilon() * std::abs(exact));
    const double again = *Unit::power_of_ten(-3).si(Unit::power_of_ten(-3).text(number));  // of any value in SI
    EXPECT_NEAR(again, number, std::numeric_limits<double>::epsilon() * std::abs(number));
  }
}

TEST(Range, NamesTheRuleThatIsBroken) {
  EXPECT_EQ(above(0).broken_by(0), "> 0");
  EXPECT_EQ(above(0).broken_by(1e-300), ">= 1e-9");
  EXPECT_EQ(above_to(0, 1).broken_by(9e-10), ">= 1e-9");
  EXPECT_EQ(above(0).broken_by(1e-9), std::nullopt);
  EXPECT_EQ(between(0, 1).broken_by(1e-300), std::nullopt);
  EXPECT_EQ(above_to(0, 1).broken_by(1), std::nullopt);
  EXPECT_EQ(above_to(0, 1).broken_by(1.5), "> 0 and <= 1");
  EXPECT_EQ(between(1, 200).broken_by(200), std::nullopt);
  EXPECT_EQ(between(1, 200).broken_by(0.5), "1 to 200");
  EXPECT_EQ(Range{}.broken_by(-1e9), std::nullopt);
  EXPECT_EQ(Range{}.broken_by(-1.1e9), "at most 1000000000 in magnitude");
  EXPECT_EQ(between(0, 4294967295).broken_by(4294967295), std::nullopt);
}

TEST(Suggestion, LooksPastTheUnit) {
  EXPECT_EQ(without_unit("radius_mm"), "radius");
  EXPECT_EQ(without_unit("source_pa_m"), "source");
  EXPECT_EQ(without_unit("sound_speed_m_s"), "sound_speed");
  EXPECT_EQ(without_unit("_mm"), "_mm");
  const MapInfo map{.keys = {{.name = "radius_mm"}, {.name = "sound_speed_m_s"}, {.name = "at_mm"}}};
  EXPECT_EQ(nearest_key(map, "radius_m"), "radius_mm");
  EXPECT_EQ(nearest_key(map, "radius_cm"), "radius_mm");
  EXPECT_EQ(nearest_key(map, "Radius-MM"), "radius_mm");
  EXPECT_EQ(nearest_key(map, "raduis_mm"), "radius_mm");
  EXPECT_EQ(nearest_key(map, "sound_speed"), "sound_speed_m_s");
  EXPECT_EQ(nearest_key(map, "zebra"), "");
  EXPECT_EQ(nearest_key(map, ""), "");
  EXPECT_EQ(nearest_key(map, std::string(10000, 'a')), "");
}

}  // namespace
}  // namespace touchfield::schema
