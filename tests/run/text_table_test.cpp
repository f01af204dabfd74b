#include "sim/run/text_table.h"

#include <numbers>

#include <nlohmann/json.hpp>

#include "tests/support/testing.h"

namespace touchfield::text_table_test {

TEST(LinesText, HasUnitsAndFewDigits) {
  EXPECT_EQ(lines_text({{"name", "hand"},
                        {"faces", 12345},
                        {"closed", true},
                        {"nothing", nullptr},
                        {"residual_mm_median", 1.23456},
                        {"largest_distance_m", 0.005},
                        {"frequency_hz", 40123.4},
                        {"turn_rad", std::numbers::pi / 2},
                        {"holes", 0.12345},
                        {"correlation", 0.99998},
                        {"unknown", std::nan("")},
                        {"at_mm", {1.0, 2.0, 3.5}},
                        {"off_mm", {{"index", 1.5}, {"thumb_m", 0.002}}},
                        {"warnings", {"one", "two", "three"}},
                        {"notes", Json::array()}}),
            "name             hand\n"
            "faces            12,345\n"
            "closed           yes\n"
            "residual median  1.235 mm\n"
            "largest distance 5 mm\n"
            "frequency        40123 Hz\n"
            "turn             90 deg\n"
            "holes            12.3 %\n"
            "correlation      0.99998\n"
            "unknown          -\n"
            "at               (1, 2, 3.5) mm\n"
            "off              index 1.5 mm, thumb 2 mm\n"
            "warnings         one\n"
            "                 two\n"
            "                 three\n");
}

TEST(CsvText, HasEveryDigit) {
  const Json row = {{"name", "a, b"}, {"number", 1.0 / 3}, {"count", 12345}, {"flag", true}, {"none", std::nan("")}};
  EXPECT_EQ(csv_text(row, Json::array({row})),
            "name,number,count,flag,none\n\"a, b\",0.3333333333333333,12345,1,nan\n");
  EXPECT_EQ(csv_text(row, Json::array()), "name,number,count,flag,none\n");
}

}  // namespace touchfield::text_table_test
