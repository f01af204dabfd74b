#include "sim/scene/text_file.h"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>

#include "sim/core/utf8.h"

namespace touchfield::schema {

namespace {

/// Characters that look like one of ASCII.
struct OddCharacters {
  std::u32string_view codes;
  const char* name;
  const char* remedy;
};

constexpr std::string_view kBlanks = " \t";  // between words

constexpr OddCharacters kOddCharacters[] = {
    {U"\u00A0\u2007\u202F", "no-break space", "write a plain space"},
    {U"\u1680\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2008\u2009\u200A\u205F\u3000", "blank", "write a plain space"},
    {U"\u2028", "line separator", "begin a new line"},
    {U"\u00AD", "soft hyphen", "leave it out"},
    {U"\u200B", "zero-width space", "leave it out"},
    {U"\u2060", "zero-width character", "leave it out"},
    {U"\uFEFF", "byte order mark", "leave it out"},
    {U"\u2010\u2011", "hyphen", "write -"},
    {U"\u2013\u2014", "dash", "write -"},
    {U"\u2212", "minus sign", "write -"},
    {U"\u2018\u2019\u201C\u201D", "quote", "write a straight quote"},
    {U"\uFF1A", "colon", "write :"},
};

/// The code of a character of 2 or 3 bytes, as all odd ones are; 0 of another.
char32_t code_at(std::string_view text, std::size_t place) {
  const std::size_t length = character_length(text, place);
  if (length != 2 && length != 3) {
    return 0;
  }
  char32_t code = static_cast<unsigned char>(text[place]) & (length == 2 ? 0x1FU : 0x0FU);
  for (const char byte : text.substr(place + 1, length - 1)) {
    code = (code << 6U) | (static_cast<unsigned char>(byte) & 0x3FU);
  }
  return code;
}

}  // namespace

std::string odd_character(std::string_view line) {
  line = line.substr(0, line.find('#'));
  for (std::size_t at = 0; at < line.size(); ++at) {
    const char32_t code = code_at(line, at);
    for (const OddCharacters& odd : kOddCharacters) {
      if (odd.codes.find(code) != std::u32string_view::npos) {
        return fmt::format("{} (U+{:04X}) at column {}, {}", odd.name, static_cast<unsigned>(code), at + 1, odd.remedy);
      }
    }
  }
  return {};
}

TextFault find_text_fault(const std::string& text) {
  int line = 1;
  std::size_t line_start = 0;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const std::size_t length = character_length(text, i);
    const bool control = (byte < 0x20 && byte != '\t' && byte != '\n' && byte != '\r') || byte == 0x7F;
    if (length == 0 || control) {
      return {line, static_cast<int>(i - line_start) + 1, byte};
    }
    i += length;
    if (byte == '\n' || (byte == '\r' && (i == text.size() || text[i] != '\n'))) {
      ++line;
      line_start = i;
    }
  }
  return {line, 0};
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::vector<std::string_view> words(std::string_view line, std::string_view between) {
  std::vector<std::string_view> parts;
  for (auto first = line.find_first_not_of(between); first != std::string_view::npos;) {
    const auto end = std::min(line.find_first_of(between, first), line.size());
    parts.push_back(line.substr(first, end - first));
    first = line.find_first_not_of(between, end);
  }
  return parts;
}

std::vector<std::string_view> cells(std::string_view line, char separator) {
  if (separator == ' ') {
    return words(line, kBlanks);
  }
  std::vector<std::string_view> parts;
  for (std::size_t at = 0; at <= line.size(); at += parts.back().size() + 1) {
    parts.push_back(line.substr(at, line.substr(at).find(separator)));
  }
  std::ranges::transform(parts, parts.begin(), trimmed);
  return parts;
}

}  // namespace touchfield::schema
