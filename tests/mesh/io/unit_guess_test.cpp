#include "sim/mesh/io/unit_guess.h"

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "sim/hand/hand.h"
#include "tests/support/surface_support.h"
#include "tests/support/testing.h"

namespace touchfield::unit_guess_test {

std::string unit_of(double size) { return guess_unit(size).unit.name; }

TEST(UnitGuess, AHandIsSureInMillimetresAndMetres) {
  for (const double metres : {0.125, 0.19, 0.44, 0.55}) {
    EXPECT_EQ(unit_of(metres * 1e3), "mm") << metres;
    EXPECT_EQ(guess_unit(metres * 1e3).certainty, UnitCertainty::kSure) << metres;
    EXPECT_EQ(unit_of(metres), "m") << metres;
    EXPECT_EQ(guess_unit(metres).certainty, UnitCertainty::kSure) << metres;
  }
}

// 19 units may be a hand in centimetres or a fingertip in millimetres, 50 a ball in millimetres.
TEST(UnitGuess, OtherBodiesAreUnclear) {
  EXPECT_EQ(unit_of(19), "mm");
  EXPECT_EQ(unit_of(50), "mm");
  EXPECT_EQ(unit_of(70), "mm");  // a finger; in cm it would be farther from a hand
  EXPECT_EQ(unit_of(700), "mm");
  EXPECT_EQ(unit_of(0.07), "m");
  EXPECT_EQ(unit_of(5), "cm");  // 5 mm is no body
  for (const double size : {19.0, 50.0, 70.0, 700.0, 0.07, 5.0}) {
    EXPECT_EQ(guess_unit(size).certainty, UnitCertainty::kUnclear) << size;
  }
}

TEST(UnitGuess, NoUnitMakesABodyOfAMicronOrAHouse) {
  for (const double size : {1e-300, 1e-4, 0.009, 1010.0, 193e3, 1e300}) {
    EXPECT_EQ(guess_unit(size).certainty, UnitCertainty::kNone) << size;
  }
  EXPECT_EQ(unit_of(193e3), "mm");
  EXPECT_EQ(unit_of(1e-4), "m");
}

TEST(UnitGuess, SaysTheSizesAndWhy) {
  EXPECT_EQ(guess_unit(0.193).reason,
            "0.193 units across: 0.193 mm if in mm, 1.93 mm if in cm, 193 mm if in m; a hand is 120 to 560 mm");
}

TEST(UnitGuess, NeedsASize) {
  for (const double size : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_THROW(guess_unit(size), InputError) << size;
  }
}

TEST(UnitGuess, KnowsTheUnits) {
  EXPECT_EQ(file_unit("cm").metres, 1e-2);
  EXPECT_THROW(file_unit("inch"), InputError);
  EXPECT_THROW(file_unit(""), InputError);
}

TEST(SurfaceSize, IsThatOfTheNamedPoints) {
  // A cube's space diagonal, whichever unit and wherever a point lies that no face names.
  FileSurface surface = file_of(cube({5, 6, 7}), 1e-3);
  surface.points.emplace_back(1e6, 0, 0);
  EXPECT_NEAR(surface_size(surface), 10 * std::sqrt(3.0), 1e-9);
  surface.triangles.clear();
  EXPECT_EQ(surface_size(surface), 0.0);
}

// The longest and the shortest of the shipped poses are what `hand` must mean.
TEST(SurfaceSize, AHandIsSurelyAHandInAnyPose) {
  for (const auto& [pose, forearm] :
       {std::pair("flat", 0.0), std::pair("fist", 0.0), std::pair("flat", kMostForearm)}) {
    HandOptions options;
    options.pose = pose;
    options.edge = 6e-3;
    options.forearm = forearm;
    const TriangleMesh mesh = hand(options).mesh;
    for (const double unit : {1e-3, 1.0}) {
      const UnitGuess guess = guess_unit(surface_size(file_of(mesh, unit)));
      EXPECT_EQ(guess.unit.metres, unit) << pose << ": " << guess.reason;
      EXPECT_EQ(guess.certainty, UnitCertainty::kSure) << pose << ": " << guess.reason;
    }
  }
}

TEST(UnitDoubt, ARunNeedsAUnitUnlessTheFileIsSurelyInMillimetres) {
  EXPECT_FALSE(unit_doubt(193, std::nullopt));
  const auto metres = unit_doubt(0.193, std::nullopt);
  ASSERT_TRUE(metres);
  EXPECT_TRUE(metres->refuse);
  EXPECT_THAT(metres->text, AllOf(HasSubstr("looks like m "), HasSubstr("193 mm if in m")));
  for (const double size : {19.0, 70.0, 5.0, 193e3, 1e-4}) {
    const auto doubt = unit_doubt(size, std::nullopt);
    ASSERT_TRUE(doubt) << size;
    EXPECT_TRUE(doubt->refuse) << size;
    EXPECT_THAT(doubt->text, HasSubstr("the unit is missing")) << size;
  }
}

TEST(UnitDoubt, AStatedUnitIsTakenAtItsWordIfItMakesABody) {
  EXPECT_FALSE(unit_doubt(193, "mm"));
  EXPECT_FALSE(unit_doubt(19, "mm"));  // a fingertip
  EXPECT_FALSE(unit_doubt(19, "cm"));
  EXPECT_FALSE(unit_doubt(0.02, "m"));
  const auto doubt = unit_doubt(0.193, "mm");
  ASSERT_TRUE(doubt);
  EXPECT_TRUE(doubt->refuse);  // surely a hand in metres
  EXPECT_THAT(doubt->text, AllOf(HasSubstr("unit mm makes the body 0.193 mm across"), HasSubstr("looks like m ")));
  const auto house = unit_doubt(193e3, "mm");
  ASSERT_TRUE(house);
  EXPECT_FALSE(house->refuse);
  EXPECT_THAT(house->text, HasSubstr("193 m across; no unit makes it one"));
  const auto ball = unit_doubt(8.6, "mm");  // small, but of use
  ASSERT_TRUE(ball);
  EXPECT_FALSE(ball->refuse);
  EXPECT_TRUE(unit_doubt(0.06, "mm")->refuse);  // no hand in any unit, but a finger in metres
  EXPECT_TRUE(unit_doubt(193, "m")->refuse);
  EXPECT_THAT(unit_doubt(7.6, "mm")->text, HasSubstr("193 mm if in inches"));
  EXPECT_THROW(unit_doubt(193, "inch"), InputError);
}

}  // namespace touchfield::unit_guess_test
