#include "sim/run/text_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "sim/core/files.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr std::size_t kLongLine = 100;
constexpr std::size_t kLeastWidth = 9;  // of a label

/// How text shows a number whose name has a word.
struct Shown {
  std::string_view word;
  const char* unit = "";
  double factor = 1;
  int digits = 4;         // significant ones
  bool in_label = false;  // whether the word remains there; it gives way to a unit

  bool share() const { return in_label && *unit != '\0'; }
};

constexpr auto share_of(std::string_view word) { return Shown{word, "%", 100, 3, true}; }

constexpr auto kShown = std::to_array<Shown>({
    {"mm", "mm"},
    {"m", "mm", 1 / kMillimetre},
    {"deg", "deg"},
    {"rad", "deg", 1 / kDegree},
    {"s", "s"},
    {"ms", "ms"},
    {"hz", "Hz"},
    {"mib", "MiB"},
    {"pa", "Pa"},
    {"db", "dB"},
    {"n", "N"},
    {"cm2", "cm2"},
    {"cm3", "cm3"},
    {"c", "C"},
    {"seconds", "", 1, 3, true},
    {"epw", "", 1, 3, true},
    {"residual", "", 1, 2, true},
    {"correlation", "", 1, 6, true},
    share_of("error"),
    share_of("relative"),
    share_of("share"),
    share_of("loss"),
    share_of("noise"),
    share_of("resonance"),
    share_of("holes"),
    share_of("seen"),
    share_of("above"),
    share_of("split"),
    share_of("l2"),
    share_of("max"),
});

/// A name as a person reads it, and how its value is shown.
struct Label {
  std::string text;
  Shown shown;
};

Label label_of_name(std::string_view name) {
  Label label;
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t end = std::min(name.find('_', at), name.size());
    const std::string_view word = name.substr(at, end - at);
    const auto* const shown = std::ranges::find(kShown, word, &Shown::word);
    const bool known = shown != kShown.end() && (shown->in_label || at > 0);
    if (known && (label.shown.word.empty() || !shown->in_label)) {
      label.shown = *shown;
    }
    if (!known || shown->in_label) {
      label.text += fmt::format("{}{}", label.text.empty() ? "" : " ",
                                word == "epw"   ? "edges per wavelength"
                                : word == "p95" ? "95 %"
                                                : word);
    }
    at = end + 1;
  }
  return label;
}

/// What there is nothing to say of.
bool is_nothing(const Json& value) {
  return value.is_object() ? std::ranges::all_of(value, is_nothing)
                           : value.empty() || (value.is_string() && value.get_ref<const std::string&>().empty());
}

bool is_table(const Json& value) { return value.is_array() && !value.empty() && value.front().is_object(); }

/// Without the unit; a few digits more rather than a power of ten.
std::string number_text(double number, const Shown& shown) {
  const double value = shown.factor * number;
  const bool whole = std::abs(value) >= std::pow(10.0, shown.digits) - 0.5 && std::abs(value) < 1e7;
  return !std::isfinite(value) ? "-"
         : whole               ? fmt::format("{:.0f}", value)
                               : fmt::format("{:.{}g}", value, shown.digits);
}

std::string text_of(const Json& value, const Shown& shown);

std::string list_text(const Json& list, const Shown& shown) {
  std::vector<std::string> items;
  for (const Json& item : list) {
    items.push_back(item.is_number_float() ? number_text(item.get<double>(), shown) : text_of(item, shown));
  }
  const bool phrases = std::ranges::any_of(items, [](const std::string& item) { return item.find(' ') != item.npos; });
  const std::string text = fmt::format("{}", fmt::join(items, phrases ? "; " : ", "));
  return *shown.unit == '\0' || !list.front().is_number_float() ? text : fmt::format("({}) {}", text, shown.unit);
}

std::string object_text(const Json& object, const Shown& shown) {
  std::vector<std::string> parts;
  for (const auto& [name, value] : object.items()) {
    if (!is_nothing(value)) {
      const Label label = label_of_name(name);
      parts.push_back(fmt::format("{}{} {}", label.text, value.is_object() ? ":" : "",
                                  text_of(value, label.shown.word.empty() ? shown : label.shown)));
    }
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string text_of(const Json& value, const Shown& shown) {
  if (value.is_number_float()) {
    const std::string text = number_text(value.get<double>(), shown);
    return *shown.unit == '\0' || text == "-" ? text : fmt::format("{} {}", text, shown.unit);
  }
  return value.is_boolean()          ? value.get<bool>() ? "yes" : "no"
         : value.is_number_integer() ? grouped(value.get<long>())
         : value.is_string()         ? value.get_ref<const std::string&>()
         : is_nothing(value)         ? "-"
         : value.is_array()          ? list_text(value, shown)
                                     : object_text(value, shown);
}

/// width   least of the labels [characters]
/// shown   of what has no unit of its own
std::string lines_of(const Json& object, std::size_t width, std::size_t indent, const Shown& shown) {
  for (const auto& [name, value] : object.items()) {
    width = is_nothing(value) || is_table(value) ? width : std::max(width, label_of_name(name).text.size());
  }
  std::string text;
  const auto line = [&](const std::string& label, const std::string& said) {
    text += fmt::format("{:{}}{:<{}} {}\n", "", indent, label, width, said);
  };
  for (const auto& [name, value] : object.items()) {
    const auto [label, own] = label_of_name(name);
    const Shown& how = own.word.empty() ? shown : own;
    if (is_nothing(value)) {
      continue;
    }
    if (is_table(value)) {
      text += fmt::format("{:{}}{}\n{}", "", indent, label, table_text(value));
    } else if (value.is_array() && value.front().is_string()) {
      for (const Json& item : value) {
        line(&item == &value.front() ? label : "", text_of(item, how));
      }
    } else if (const std::string said = text_of(value, how); !value.is_object() || said.size() <= kLongLine) {
      line(label, said);
    } else {
      text += fmt::format("{:{}}{}\n{}", "", indent, label,
                          lines_of(value, width - std::min<std::size_t>(width, 2), indent + 2, how));
    }
  }
  return text;
}

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

/// A line of a CSV file; fields are quoted only where RFC 4180 asks for it.
std::string csv_line(const std::vector<std::string>& fields) {
  std::vector<std::string> quoted;
  std::ranges::transform(fields, std::back_inserter(quoted), csv_field);
  return fmt::format("{}\n", fmt::join(quoted, ","));
}

/// As many digits as it takes to read the number back exactly; "nan" where nothing was computed.
std::string csv_number(double value) {
  return std::isnan(value) ? "nan" : fmt::format("{}", value);  // fmt gives a NaN's sign
}

}  // namespace

std::string aligned_table(const std::vector<std::vector<std::string>>& rows, const std::vector<std::size_t>& left) {
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      widths[c] = std::max(widths[c], row[c].size());
    }
  }
  std::string text;
  for (const auto& row : rows) {
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

std::string value_text(const Json& value, std::string_view name) { return text_of(value, label_of_name(name).shown); }

std::string table_text(const Json& rows, std::size_t most) {
  std::vector<std::string> columns;
  for (const Json& row : rows) {
    for (const auto& [name, value] : row.items()) {
      if (!is_nothing(value) && std::ranges::find(columns, name) == columns.end()) {
        columns.push_back(name);
      }
    }
  }
  std::vector<std::vector<std::string>> cells(1);
  std::vector<std::size_t> left;
  for (const std::string& column : columns) {
    const auto [text, shown] = label_of_name(column);
    if (rows.front().value(column, Json()).is_string()) {
      left.push_back(cells.front().size());
    }
    cells.front().push_back(*shown.unit == '\0' || shown.share() ? text : fmt::format("{} [{}]", text, shown.unit));
  }
  for (std::size_t i = 0; i < std::min(rows.size(), most); ++i) {
    cells.emplace_back();
    for (const std::string& column : columns) {
      Shown shown = label_of_name(column).shown;
      shown.unit = shown.share() ? shown.unit : "";
      cells.back().push_back(text_of(rows[i].value(column, Json()), shown));
    }
  }
  return aligned_table(cells, left) + (rows.size() > most ? fmt::format("  and {} more\n", rows.size() - most) : "");
}

std::string csv_text(const Json& columns, const Json& rows) {
  std::vector<std::string> fields;
  for (const auto& [name, value] : columns.items()) {
    fields.push_back(name);
  }
  std::string text = csv_line(fields);
  for (const Json& row : rows) {
    fields.clear();
    for (const Json& value : row) {
      fields.push_back(value.is_number_float() ? csv_number(value.get<double>())
                       : value.is_boolean()    ? (value.get<bool>() ? "1" : "0")
                       : value.is_string()     ? value.get<std::string>()
                       : value.is_null()       ? ""
                                               : value.dump());
    }
    text += csv_line(fields);
  }
  return text;
}

std::string lines_text(const Json& object) { return lines_of(object, kLeastWidth, 0, {}); }

void write_text_file(const std::string& path, const std::string& text) { write_atomically(path, {text}); }

}  // namespace touchfield
