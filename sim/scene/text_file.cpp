#include "sim/scene/text_file.h"

#include <algorithm>
#include <cstddef>

namespace touchfield::schema {

namespace {

constexpr std::string_view kBlanks = " \t";  // between words

}  // namespace

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
