#include "sim/scene/text_file.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace touchfield::schema {
namespace {

// Column of the fault in a one-line text; 0: none.
int fault_column(const std::string& text) { return find_text_fault(text).column; }

TEST(TextFault, NoneInUtf8) {
  EXPECT_EQ(fault_column(""), 0);
  EXPECT_EQ(fault_column("a\tb\r\n"), 0);
  EXPECT_EQ(fault_column("\xC3\xA4"), 0);          // two bytes
  EXPECT_EQ(fault_column("\xE2\x82\xAC"), 0);      // three
  EXPECT_EQ(fault_column("\xF0\x9F\x98\x80"), 0);  // four
  EXPECT_EQ(fault_column("\xEF\xBB\xBF#"), 0);     // a byte order mark
  EXPECT_EQ(fault_column("\xF4\x8F\xBF\xBF"), 0);  // the last code point
}

TEST(TextFault, InWhatIsNoCharacter) {
  EXPECT_EQ(fault_column("ab\x80"), 3);            // a continuation alone
  EXPECT_EQ(fault_column("\xC3"), 1);              // cut short
  EXPECT_EQ(fault_column("\xC3("), 1);             // no continuation
  EXPECT_EQ(fault_column("\xC0\xAF"), 1);          // longer than need be, two bytes
  EXPECT_EQ(fault_column("\xE0\x80\xAF"), 1);      // three
  EXPECT_EQ(fault_column("\xF0\x80\x80\xAF"), 1);  // four
  EXPECT_EQ(fault_column("\xED\xA0\x80"), 1);      // a surrogate
  EXPECT_EQ(fault_column("\xF4\x90\x80\x80"), 1);  // beyond the last code point
  EXPECT_EQ(fault_column("\xFF\xFE"), 1);          // UTF-16's mark
  EXPECT_EQ(fault_column(std::string("a\0b", 3)), 2);
  EXPECT_EQ(fault_column("\x7F"), 1);
}

TEST(TextFault, CountsLines) {
  const auto fault = find_text_fault("one\ntwo\r\n\xC3\xA4 \x01");
  EXPECT_EQ(fault.line, 3);
  EXPECT_EQ(fault.column, 4);  // bytes
}

TEST(TextFault, CountsLinesThatEndWithAReturn) { EXPECT_EQ(find_text_fault("one\rtwo\r\nthree\n\x01").line, 4); }

TEST(TextLines, EndWithAFeedAReturnOrBoth) {
  std::vector<std::string> lines;
  for_each_text_line("a\nb\rc\r\n\r\rd", [&](int number, std::string_view line) {
    lines.push_back(std::to_string(number) + std::string(line));
  });
  EXPECT_EQ(lines, (std::vector<std::string>{"1a", "2b", "3c", "4", "5", "6d"}));
}

TEST(OddCharacter, IsNamedWithItsPlaceAndRemedy) {
  EXPECT_EQ(odd_character("\u00A0a: 1"), "no-break space (U+00A0) at column 1, write a plain space");
  EXPECT_EQ(odd_character("\u00E9 \u202F"), "no-break space (U+202F) at column 4, write a plain space");
  EXPECT_EQ(odd_character("a: \u22121"), "minus sign (U+2212) at column 4, write -");
  EXPECT_EQ(odd_character("a\u200B: 1"), "zero-width space (U+200B) at column 2, leave it out");
  EXPECT_EQ(odd_character("a: \u201Cb\u201D"), "quote (U+201C) at column 4, write a straight quote");
  EXPECT_EQ(odd_character("\uFEFFa: 1"), "byte order mark (U+FEFF) at column 1, leave it out");
  EXPECT_EQ(odd_character("a: 1  # 20\u00A0mm \u2013 wide"), "");
  EXPECT_EQ(odd_character("na\u00EFve: \u00B5m"), "");
}

}  // namespace
}  // namespace touchfield::schema
