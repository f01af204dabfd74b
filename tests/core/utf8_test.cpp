// Texts of any bytes: what a terminal is shown of them, and how they go through JSON and back.

#include "sim/core/utf8.h"

#include <string>

#include <nlohmann/json.hpp>

#include "sim/core/json_text.h"
#include "tests/support/testing.h"

namespace touchfield::utf8_test {

using Json = nlohmann::ordered_json;

TEST(Utf8, ATerminalIsShownNoControl) {
  EXPECT_EQ(visible_text("plain \xC3\xA9 \xE2\x82\xAC \xF0\x9F\x98\x80\ttext\n"),
            "plain \xC3\xA9 \xE2\x82\xAC \xF0\x9F\x98\x80\ttext\n");
  EXPECT_EQ(visible_text("\x1B[31m\r\x07\x7F"), "\\u001b[31m\\u000d\\u0007\\u007f");
  EXPECT_EQ(visible_text(std::string("a\0b", 3)), "a\\u0000b");
  EXPECT_EQ(visible_text("\xC2\x9B"
                         "31m \xC2\xA0"),
            "\\u009b31m \xC2\xA0");  // CSI in one character
  EXPECT_EQ(visible_text("\xE2\x80\xAE"
                         "txt.exe\xE2\x81\xA9"),
            "\\u202etxt.exe\\u2069");                 // right to left
  EXPECT_EQ(visible_text("o\xFF\xC3"), "o\xFF\xC3");  // a path stays one
  EXPECT_EQ(one_line("a\nb\tc"), "a\\u000ab\\u0009c");
}

TEST(JsonText, AnyBytesComeBack) {
  std::string all;
  for (int byte = 0; byte < 256; ++byte) {
    all += static_cast<char>(byte);
  }
  for (const std::string& text :
       {all, std::string("o\xFF"), std::string("\xF4\x8F\xBE\x80 \xF4\x8F\xBF\xBF"), std::string("\xF4\x8F\xBE"),
        std::string("\xED\xB2\x80"), std::string("\\udc80 \\\\udcff \""), std::string("\xF0\x9F\x98\x80\xC0\xAF"),
        std::string("\xC3\xA9\xC3")}) {
    const Json json = {{"text", text}, {text, {1, 2.5, nullptr, {text}}}};
    const std::string written = json_text(json, 1);
    EXPECT_NO_THROW(Json(written).dump()) << "not UTF-8: " << written;
    EXPECT_EQ(json_from_text<Json>(written), json);
    EXPECT_EQ(json_text(json_from_text<Json>(json_text(json))), json_text(json));
  }
}

TEST(JsonText, IsAsPythonHasIt) {
  EXPECT_EQ(json_text(Json("o\xFF")), R"("o\udcff")");
  EXPECT_EQ(json_text(Json("\xC3\xA9\xE9")), "\"\xC3\xA9\\udce9\"");
  EXPECT_EQ(json_from_text<Json>(R"("\udcff")"), Json("\xFF"));
  EXPECT_EQ(json_from_text<Json>(R"("\\udcff")"), Json("\\udcff"));
  EXPECT_EQ(json_from_text<Json>(R"("\ud83d\udcff")"), Json("\xF0\x9F\x93\xBF"));  // a pair: one character
}

TEST(JsonText, WhatIsNoJsonIsRefused) {
  for (const char* text : {"", "{", R"("\udc")", R"("\ud800")", R"("\udc00")", "\xFF", "\"\xFF\"", "\\udcff"}) {
    EXPECT_THROW(json_from_text<Json>(text), Json::exception) << text;
  }
  EXPECT_THROW(json_from_text<Json>(std::string(1000000, '[')), InputError);
  EXPECT_NO_THROW(json_from_text<Json>("\"" + std::string(1000, '[') + "\""));
}

}  // namespace touchfield::utf8_test
