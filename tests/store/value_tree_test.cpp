#include "sim/store/value_tree.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace touchfield {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const Value kSaid = {{"name", "hand"},
                     {"faces", 12345},
                     {"closed", true},
                     {"nothing", {}},
                     {"residual_mm_median", {1.23456, 3}},
                     {"largest_distance_m", 0.005},
                     {"turn_rad", std::numbers::pi / 2},
                     {"holes", Value::share(0.125)},
                     {"unknown", std::nan("")},
                     {"at_mm", std::vector<double>{1, 2, 3.5}},
                     {"warnings", std::vector<std::string>{"first", "second"}},
                     {"notes", std::vector<std::string>()}};

TEST(Value, AsJsonHasEveryDigitAndEveryName) {
  EXPECT_EQ(kSaid.json(-1), R"({"name":"hand","faces":12345,"closed":true,"nothing":null,"residual_mm_median":1.23456,)"
                            R"("largest_distance_m":0.005,"turn_rad":1.5707963267948966,"holes":0.125,"unknown":null,)"
                            R"("at_mm":[1.0,2.0,3.5],"warnings":["first","second"],"notes":[]})");
}

TEST(Value, AsTextHasUnitsAndFewDigits) {
  EXPECT_EQ(lines_text(kSaid),
            "name             hand\n"
            "faces            12,345\n"
            "closed           yes\n"
            "residual median  1.23 mm\n"
            "largest distance 5 mm\n"
            "turn             90 deg\n"
            "holes            12.5 %\n"
            "unknown          -\n"
            "at               (1, 2, 3.5) mm\n"
            "warnings         first\n"
            "                 second\n");
}

TEST(Value, AChangeHasItsSignInPercentOrPoints) {
  EXPECT_EQ(value_text(std::pair(5.0, 4.5), "width_mm"), "5 mm -> 4.5 mm (-10 %)");
  EXPECT_EQ(value_text(std::pair(Value::share(0.461), Value::share(0.473))), "46.1 % -> 47.3 % (+1.2 points)");
  EXPECT_EQ(value_text(std::pair(48, 48)), "48");
  EXPECT_EQ(value_text(std::pair(0, 8)), "0 -> 8");
  EXPECT_EQ(value_text(std::pair(std::optional<std::string>(), std::string())), "(absent) -> (empty)");
}

TEST(Value, NamesThatAreDataStayAsTheyAre) {
  const Value landmarks = Value::by_name({{"index_m", 1.5}});
  EXPECT_EQ(lines_text({{"landmarks_off_mm", landmarks}}), "landmarks off index_m 1.5 mm\n");
  const Value many = Value::by_name(Value::Group(20, {"index_m", 1.5}));
  EXPECT_THAT(lines_text({{"landmarks_off_mm", many}}),
              HasSubstr("landmarks off\n  index_m     1.5 mm\n  index_m     1.5 mm\n"));
}

TEST(Value, ALongGroupIsIndentedAndAListOfGroupsIsATable) {
  const std::string text = lines_text(
      {{"part", {{"first", std::string(60, 'x')}, {"second", std::string(60, 'y')}}},
       {"rows", Value::List{Value{{"name", "a"}, {"edge_mm", 2.5}}, Value{{"name", "longer"}, {"edge_mm", 10}}}}});
  EXPECT_THAT(text, HasSubstr("part\n  first   xxx"));
  EXPECT_THAT(text, HasSubstr("rows\n  name    edge [mm]\n  a             2.5\n  longer         10\n"));
}

TEST(Value, ATableSaysHowManyRowsItLeavesOut) {
  const std::string text = table_text(Value::List(50, Value{{"number", 1}}));
  EXPECT_THAT(text, HasSubstr("\n  and 10 more\n"));
  EXPECT_THAT(table_text(Value::List(40, Value{{"number", 1}})), Not(HasSubstr("more")));
}

TEST(Value, AsCsvHasEveryDigit) {
  const Value row = {{"name", "a, b"}, {"number", 1.0 / 3}, {"count", 12345}, {"flag", true}, {"none", std::nan("")}};
  EXPECT_EQ(csv_text(row, {row}), "name,number,count,flag,none\n\"a, b\",0.3333333333333333,12345,1,nan\n");
  EXPECT_EQ(csv_text(row, {}), "name,number,count,flag,none\n");
}

TEST(Value, WhatIsNotThereIsNothing) {
  EXPECT_TRUE(kSaid["missing"].empty());
  EXPECT_TRUE(kSaid["missing"]["deeper"].empty());
  EXPECT_FALSE(kSaid["faces"].empty());
}

}  // namespace
}  // namespace touchfield
