#include "sim/scene/text_file.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include <fmt/format.h>

#include "sim/core/utf8.h"

namespace touchfield::schema {

namespace {

struct OddCharacter {
  std::string_view bytes;
  const char* name;
  const char* remedy;
};

constexpr std::string_view kBlanks = " \t";  // between words

constexpr const char* kBlank = "write a plain space";
constexpr const char* kNothing = "leave it out";
constexpr const char* kDash = "write -";
constexpr const char* kQuote = "write a straight quote";

constexpr std::array<OddCharacter, 31> kOddCharacters = {{
    {"\u00A0", "no-break space (U+00A0)", kBlank},
    {"\u1680", "blank (U+1680)", kBlank},
    {"\u2000", "blank (U+2000)", kBlank},
    {"\u2001", "blank (U+2001)", kBlank},
    {"\u2002", "blank (U+2002)", kBlank},
    {"\u2003", "blank (U+2003)", kBlank},
    {"\u2004", "blank (U+2004)", kBlank},
    {"\u2005", "blank (U+2005)", kBlank},
    {"\u2006", "blank (U+2006)", kBlank},
    {"\u2007", "no-break space (U+2007)", kBlank},
    {"\u2008", "blank (U+2008)", kBlank},
    {"\u2009", "blank (U+2009)", kBlank},
    {"\u200A", "blank (U+200A)", kBlank},
    {"\u202F", "no-break space (U+202F)", kBlank},
    {"\u205F", "blank (U+205F)", kBlank},
    {"\u3000", "blank (U+3000)", kBlank},
    {"\u2028", "line separator (U+2028)", "begin a new line"},
    {"\u00AD", "soft hyphen (U+00AD)", kNothing},
    {"\u200B", "zero-width space (U+200B)", kNothing},
    {"\u2060", "zero-width character (U+2060)", kNothing},
    {"\uFEFF", "byte order mark (U+FEFF)", kNothing},
    {"\u2010", "hyphen (U+2010)", kDash},
    {"\u2011", "hyphen (U+2011)", kDash},
    {"\u2013", "dash (U+2013)", kDash},
    {"\u2014", "dash (U+2014)", kDash},
    {"\u2212", "minus sign (U+2212)", kDash},
    {"\u2018", "quote (U+2018)", kQuote},
    {"\u2019", "quote (U+2019)", kQuote},
    {"\u201C", "quote (U+201C)", kQuote},
    {"\u201D", "quote (U+201D)", kQuote},
    {"\uFF1A", "colon (U+FF1A)", "write :"},
}};

}  // namespace

std::string odd_character(std::string_view line) {
  line = line.substr(0, line.find('#'));
  for (std::size_t at = 0; at < line.size(); ++at) {
    if (static_cast<unsigned char>(line[at]) < 0x80) {
      continue;
    }
    for (const OddCharacter& odd : kOddCharacters) {
      if (line.substr(at).starts_with(odd.bytes)) {
        return fmt::format("{} at column {}, {}", odd.name, at + 1, odd.remedy);
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
