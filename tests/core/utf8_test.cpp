#include <string>
#include <utility>
#include <vector>

#include "sim/core/text.h"
#include "tests/support/testing.h"

namespace touchfield::utf8_test {

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

}  // namespace touchfield::utf8_test
