#include "sim/core/text.h"

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "sim/core/json.h"
#include "tests/support/testing.h"

namespace touchfield::text_test {

using namespace std::string_literals;

TEST(Utf8, TextEndsBeforeTheFirstByteThatIsNot) {
  const std::vector<std::pair<std::string, std::size_t>> table = {
      {"", 0},
      {"a\tb\r\n", 5},
      {"\xEF\xBB\xBF\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80\xF4\x8F\xBF\xBF", 16},
      {"ab\x80", 2},              // a continuation alone
      {"a\xC3", 1},               // cut short
      {"\xC3(", 0},               // no continuation
      {"a\xC0\xAF", 1},           // longer than need be, two bytes
      {"a\xE0\x80\xAF", 1},       // three
      {"\xF0\x80\x80\xAF", 0},    // four
      {"a\xED\xA0\x80", 1},       // a surrogate
      {"\xF4\x90\x80\x80", 0},    // beyond the last code point
      {"\xFF\xFE"s + "n\0"s, 0},  // UTF-16
      {"n\0a\0"s, 1},             // without its mark
      {"a\x1B[1m", 1},            // controls
      {"a\x7F", 1},
      {"a\rb", 1},
  };
  for (const auto& [bytes, length] : table) {
    EXPECT_EQ(length_of_text(bytes), length) << ::testing::PrintToString(bytes);
  }
}

TEST(Utf8, AFaultIsNamedByLineAndColumn) {
  EXPECT_NO_THROW(require_text("one\ntwo\r\n", "a.csv"));
  EXPECT_EQ(message_of<InputError>([] { require_text("one\ntwo\r\n\xC3\xA4 \x01", "a.csv"); }),
            "a.csv:3:4: byte 0x01 is not UTF-8 text; save the file as UTF-8");
  EXPECT_THAT(message_of<InputError>([] { require_text("\xFF\xFE", "a.csv"); }), StartsWith("a.csv:1:1: byte 0xff"));
}

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

}  // namespace touchfield::text_test
