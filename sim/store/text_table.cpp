#include "sim/store/text_table.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/utf8.h"

namespace touchfield {

namespace {

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    return std::string(text);
  }
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c;
    if (c == '"') {
      quoted += c;
    }
  }
  return quoted + '"';
}

}  // namespace

std::string csv_line(const std::vector<std::string>& fields) {
  std::vector<std::string> quoted;
  std::ranges::transform(fields, std::back_inserter(quoted), csv_field);
  return fmt::format("{}\n", fmt::join(quoted, ","));
}

std::string csv_number(double value) {
  return std::isnan(value) ? "nan" : fmt::format("{}", value);  // fmt gives a NaN's sign
}

std::string aligned_table(const std::vector<std::vector<std::string>>& rows, const std::vector<std::size_t>& left) {
  std::vector<std::vector<std::string>> shown = rows;
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (auto& row : shown) {
    std::ranges::transform(row, row.begin(), one_line);
    for (std::size_t c = 0; c < row.size(); ++c) {
      widths[c] = std::max(widths[c], row[c].size());
    }
  }
  std::string text;
  for (const auto& row : shown) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const bool to_the_left = c == 0 || std::ranges::find(left, c) != left.end();
      line += to_the_left ? fmt::format("  {:<{}}", row[c], widths[c]) : fmt::format("  {:>{}}", row[c], widths[c]);
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

std::string table_number(double value, const char* format) {
  return std::isnan(value) ? "-" : fmt::format(fmt::runtime(format), value);
}

std::string grouped(long n) {
  std::string digits = fmt::format("{}", n);
  const std::size_t first = n < 0 ? 1 : 0;
  for (std::size_t at = digits.size(); at > first + 3;) {
    at -= 3;
    digits.insert(at, ",");
  }
  return digits;
}

}  // namespace touchfield
