#include "sim/scene/text_file.h"

#include <string>

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

}  // namespace
}  // namespace touchfield::schema
