#include "sim/mesh/io/unit_guess.h"

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/testing.h"

namespace touchfield::unit_guess_test {

// 19 units may be a hand in centimetres or a fingertip in millimetres, 50 a ball in millimetres, 70 a finger.
TEST(UnitGuess, IsSureOfHandsAlone) {
  using C = UnitCertainty;
  struct Case {
    double size;
    std::string unit;
    C certainty;
  };
  const std::vector<Case> cases = {{125, "mm", C::kSure},    {190, "mm", C::kSure},   {550, "mm", C::kSure},
                                   {0.125, "m", C::kSure},   {0.55, "m", C::kSure},   {19, "mm", C::kUnclear},
                                   {50, "mm", C::kUnclear},  {70, "mm", C::kUnclear}, {700, "mm", C::kUnclear},
                                   {0.07, "m", C::kUnclear}, {5, "cm", C::kUnclear},  {1e-4, "m", C::kNone},
                                   {193e3, "mm", C::kNone}};
  for (const auto& [size, unit, certainty] : cases) {
    EXPECT_EQ(guess_unit(size).unit.name, unit) << size;
    EXPECT_EQ(guess_unit(size).certainty, certainty) << size;
  }
  EXPECT_EQ(guess_unit(0.193).reason,
            "0.193 units across: 0.193 mm if in mm, 1.93 mm if in cm, 193 mm if in m; a hand is 120 to 560 mm");
  for (const double size : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_THROW(guess_unit(size), InputError) << size;
  }
}

TEST(UnitDoubt, AStatedUnitIsTakenIfItMakesABodyAndAMissingOneIfItIsSurelyMillimetres) {
  using Unit = std::optional<std::string>;
  for (const auto& [size, unit] :
       {std::pair<double, Unit>{193, {}}, {193, "mm"}, {19, "mm"}, {19, "cm"}, {0.02, "m"}}) {  // 19 mm: a fingertip
    EXPECT_FALSE(unit_doubt(size, unit)) << size;
  }
  struct Case {
    double size;
    Unit unit;
    bool refuse;
    std::string phrase;
  };
  const std::vector<Case> cases = {
      {0.193, {}, true, "looks like m "},
      {19, {}, true, "the unit is missing"},
      {193e3, {}, true, "the unit is missing"},
      {0.193, "mm", true, "unit mm makes the body 0.193 mm across"},  // surely a hand in metres
      {193e3, "mm", false, "193 m across; no unit makes it one"},
      {8.6, "mm", false, ""},  // small, but of use
      {0.06, "mm", true, ""},  // no hand in any unit, but a finger in metres
      {193, "m", true, ""}};
  for (const auto& [size, unit, refuse, phrase] : cases) {
    const auto doubt = unit_doubt(size, unit);
    ASSERT_TRUE(doubt) << size;
    EXPECT_EQ(doubt->refuse, refuse) << size;
    EXPECT_THAT(doubt->text, HasSubstr(phrase));
  }
  EXPECT_THAT(unit_doubt(7.6, "mm")->text, HasSubstr("193 mm if in inches"));
  EXPECT_THROW(unit_doubt(193, "inch"), InputError);
}

}  // namespace touchfield::unit_guess_test
