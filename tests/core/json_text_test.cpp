#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/core/json.h"

namespace touchfield::json_text_test {

TEST(JsonText, KeepsTheOrderAndEveryDigit) {
  EXPECT_EQ(json_text(Json{{"b", 0.1}, {"a", {1, true, nullptr}}}), R"({"b":0.1,"a":[1,true,null]})");
}

TEST(JsonText, ANumberThatIsNotFiniteIsNull) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(json_text(Json{std::numeric_limits<double>::quiet_NaN(), kInfinity, -kInfinity}), "[null,null,null]");
}

TEST(JsonText, WhatIsNoUtf8IsReplaced) {
  EXPECT_EQ(json_text(Json{{"k\xFF", "o\xC3\xA9\xE9"}}), "{\"k\xEF\xBF\xBD\":\"o\xC3\xA9\xEF\xBF\xBD\"}");
  EXPECT_TRUE(Json::accept(json_text(Json("\xED\xA0\x80 \xC0\xAF \xF5"))));
}

}  // namespace touchfield::json_text_test
