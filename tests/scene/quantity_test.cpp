#include "sim/scene/quantity.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace touchfield::schema
