#include "sim/store/value_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "sim/core/json_text.h"
#include "sim/core/units.h"
#include "sim/core/utf8.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

using ValueJson = nlohmann::ordered_json;

constexpr std::size_t kLongLine = 100;
constexpr std::size_t kLeastWidth = 9;  // of a label
constexpr std::size_t kMostTexts = 40;  // JSON has them all

struct ShownUnit {
  std::string_view word;
  const char* text = "";
  double factor = 1;
};

constexpr std::array<ShownUnit, 14> kUnits = {{{"mm", "mm"},
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
                                               {"c", "C"}}};

/// A name as a person reads it, and its unit.
struct Label {
  std::string text;
  ShownUnit unit;
};

Label label_and_unit(std::string_view name) {
  Label label;
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t end = std::min(name.find('_', at), name.size());
    const std::string_view word = name.substr(at, end - at);
    const auto* const unit = std::ranges::find(kUnits, word, &ShownUnit::word);
    if (at > 0 && unit != kUnits.end()) {
      label.unit = *unit;
    } else {
      label.text += fmt::format("{}{}", label.text.empty() ? "" : " ",
                                word == "epw"   ? "edges per wavelength"
                                : word == "p95" ? "95 %"
                                                : word);
    }
    at = end + 1;
  }
  return label;
}

/// Of an entry of a group.
Label label_in(const Value& group, const std::string& name) {
  return group.is_by_name() ? Label{name, {}} : label_and_unit(name);
}

bool is_table(const Value& value) {
  return value.is<Value::List>() && !value.list().empty() && value.list().front().is<Value::Group>();
}

bool is_change(const Value& value) {
  return value.is<Value::Group>() && value.group().size() == 2 && value.group()[0].name == "a" &&
         value.group()[1].name == "b";
}

/// Without the unit; a few digits more rather than a power of ten.
std::string number_text(const Value::Number& number, double factor) {
  const double value = factor * number.value;
  const bool whole = std::abs(value) >= std::pow(10.0, number.digits) - 0.5 && std::abs(value) < 1e7;
  return !std::isfinite(value) ? "-"
         : whole               ? fmt::format("{:.0f}", value)
                               : fmt::format("{:.{}g}", value, number.digits);
}

/// By how much b is more than a: in percent of a, of shares in points.
std::string growth(const Value& a, const Value& b) {
  const auto size = [](const Value& value) {
    return value.is<std::int64_t>()    ? static_cast<double>(value.count())
           : value.is<Value::Number>() ? value.number()
                                       : std::nan("");
  };
  const double more = size(b) - size(a);
  if (!std::isfinite(more) || more == 0) {
    return "";
  }
  const bool share = a.is<Value::Number>() && std::get<Value::Number>(a.data()).share;
  if (!share && size(a) == 0) {
    return "";
  }
  const double shown = 100 * more / (share ? 1 : std::abs(size(a)));
  return fmt::format(" ({}{} {})", shown > 0 ? "+" : "", number_text({shown, 2}, 1), share ? "points" : "%");
}

std::string shown(const Value& value, const ShownUnit& unit);

std::string change_text(const Value& a, const Value& b, const ShownUnit& unit) {
  const auto side = [&](const Value& value) {
    return value.is<std::monostate>() ? "(absent)" : value.empty() ? "(empty)" : shown(value, unit);
  };
  return a.json() == b.json() ? side(a) : fmt::format("{} -> {}{}", side(a), side(b), growth(a, b));
}

std::string list_text(const Value::List& list, const ShownUnit& unit) {
  std::vector<std::string> items;
  for (const Value& item : list) {
    items.push_back(item.is<Value::Number>() ? number_text(std::get<Value::Number>(item.data()), unit.factor)
                                             : shown(item, unit));
  }
  const bool phrases = std::ranges::any_of(items, [](const std::string& item) { return item.find(' ') != item.npos; });
  const std::string text = fmt::format("{}", fmt::join(items, phrases ? "; " : ", "));
  return *unit.text == '\0' ? text : fmt::format("({}) {}", text, unit.text);
}

std::string group_text(const Value& group, const ShownUnit& unit) {
  if (is_change(group)) {
    return change_text(group["a"], group["b"], unit);
  }
  std::vector<std::string> parts;
  for (const auto& [name, value] : group.group()) {
    if (!value.empty()) {
      const bool nested = value.is<Value::Group>() && !is_change(value);
      const Label label = label_in(group, name);
      parts.push_back(fmt::format("{}{} {}", label.text, nested ? ":" : "",
                                  shown(value, label.unit.word.empty() ? unit : label.unit)));
    }
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string shown(const Value& value, const ShownUnit& unit) {
  if (value.is<bool>()) {
    return value.flag() ? "yes" : "no";
  }
  if (value.is<std::int64_t>()) {
    return grouped(value.count());
  }
  if (value.is<Value::Number>()) {
    const auto& number = std::get<Value::Number>(value.data());
    const char* const behind = number.share ? "%" : unit.text;
    const std::string text = number_text(number, number.share ? 100 : unit.factor);
    return *behind == '\0' || text == "-" ? text : fmt::format("{} {}", text, behind);
  }
  if (value.is<std::string>()) {
    return one_line(value.text());
  }
  return value.is<Value::List>()    ? list_text(value.list(), unit)
         : value.is<Value::Group>() ? group_text(value, unit)
                                    : "-";
}

/// Names of the columns in which a row has something.
std::vector<std::string> columns_of(const Value::List& rows) {
  std::vector<std::string> columns;
  for (const Value& row : rows) {
    for (const auto& [name, value] : row.group()) {
      if (!value.empty() && std::ranges::find(columns, name) == columns.end()) {
        columns.push_back(name);
      }
    }
  }
  return columns;
}

ValueJson json_of(const Value& value) {
  if (value.is<Value::List>()) {
    ValueJson json = ValueJson::array();
    std::ranges::transform(value.list(), std::back_inserter(json), json_of);
    return json;
  }
  if (value.is<Value::Group>()) {
    ValueJson json = ValueJson::object();
    for (const auto& [name, part] : value.group()) {
      json[name] = json_of(part);
    }
    return json;
  }
  if (value.is<Value::Number>()) {
    return std::isfinite(value.number()) ? ValueJson(value.number()) : ValueJson();
  }
  return value.is<bool>()           ? ValueJson(value.flag())
         : value.is<std::int64_t>() ? ValueJson(value.count())
         : value.is<std::string>()  ? ValueJson(value.text())
                                    : ValueJson();
}

}  // namespace

Value::Value(Group group) : data_(std::move(group)) {}

Value::Value(std::initializer_list<NamedValue> group) : data_(Group(group)) {}

Value Value::by_name(Group group) {
  Value value = std::move(group);
  value.is_by_name_ = true;
  return value;
}

Value Value::share(double fraction, int digits) {
  Value value;
  value.data_ = Number{fraction, digits, true};
  return value;
}

bool Value::empty() const {
  return is<std::monostate>() || (is<std::string>() && text().empty()) || (is<List>() && list().empty()) ||
         (is<Group>() && group().empty());
}

const Value& Value::operator[](std::string_view name) const {
  static const Value nothing;
  if (!is<Group>()) {
    return nothing;
  }
  const auto found = std::ranges::find(group(), name, &NamedValue::name);
  return found == group().end() ? nothing : found->value;
}

void Value::add(std::string name, Value value) {
  std::get<Group>(data_).push_back({std::move(name), std::move(value)});
}

void Value::add(Value more) {
  std::ranges::move(std::get<Group>(more.data_), std::back_inserter(std::get<Group>(data_)));
}

std::string Value::json(int indent) const { return json_text(json_of(*this), indent); }

std::string csv_text(const Value& columns, const Value::List& rows) {
  std::vector<std::string> fields;
  std::ranges::transform(columns.group(), std::back_inserter(fields), &NamedValue::name);
  std::string text = csv_line(fields);
  for (const Value& row : rows) {
    fields.clear();
    for (const auto& [name, value] : row.group()) {
      fields.push_back(value.is<Value::Number>()  ? csv_number(value.number())
                       : value.is<std::int64_t>() ? fmt::to_string(value.count())
                       : value.is<bool>()         ? std::string(value.flag() ? "1" : "0")
                       : value.is<std::string>()  ? value.text()
                                                  : "");
    }
    text += csv_line(fields);
  }
  return text;
}

std::string label_of(std::string_view name) { return label_and_unit(name).text; }

std::string value_text(const Value& value, std::string_view name) { return shown(value, label_and_unit(name).unit); }

std::string table_text(const Value::List& list, std::size_t most) {
  const std::vector<std::string> columns = columns_of(list);
  std::vector<std::vector<std::string>> rows(1);
  std::vector<std::size_t> left;
  for (const std::string& column : columns) {
    const auto [text, unit] = label_and_unit(column);
    if (list.front()[column].is<std::string>()) {
      left.push_back(rows.front().size());
    }
    rows.front().push_back(*unit.text == '\0' ? text : fmt::format("{} [{}]", text, unit.text));
  }
  for (std::size_t i = 0; i < std::min(list.size(), most); ++i) {
    rows.emplace_back();
    for (const std::string& column : columns) {
      const ShownUnit unit = label_and_unit(column).unit;
      rows.back().push_back(shown(list[i][column], {unit.word, "", unit.factor}));
    }
  }
  return aligned_table(rows, left) + (list.size() > most ? fmt::format("  and {} more\n", list.size() - most) : "");
}

namespace {

/// width   least of the labels [characters]
/// unit    of what has none of its own
std::string lines_of(const Value& group, std::size_t width, std::size_t indent, const ShownUnit& unit) {
  for (const auto& [name, value] : group.group()) {
    width = value.empty() || is_table(value) ? width : std::max(width, label_in(group, name).text.size());
  }
  std::string text;
  const auto line = [&](const std::string& label, const std::string& said) {
    text += fmt::format("{:{}}{:<{}} {}\n", "", indent, label, width, said);
  };
  for (const auto& [name, value] : group.group()) {
    const auto [label, own] = label_in(group, name);
    const ShownUnit& shown_unit = own.word.empty() ? unit : own;
    if (value.empty()) {
      continue;
    }
    if (is_table(value)) {
      text += fmt::format("{:{}}{}\n{}", "", indent, label, table_text(value.list()));
    } else if (value.is<Value::List>() && value.list().front().is<std::string>()) {
      const Value::List& texts = value.list();
      for (std::size_t i = 0; i < std::min(texts.size(), kMostTexts); ++i) {
        line(i == 0 ? label : "", value_text(texts[i]));
      }
      if (texts.size() > kMostTexts) {
        line("", fmt::format("and {} more", texts.size() - kMostTexts));
      }
    } else if (const std::string said = shown(value, shown_unit);
               !value.is<Value::Group>() || said.size() <= kLongLine) {
      line(label, said);
    } else {
      text += fmt::format("{:{}}{}\n{}", "", indent, label,
                          lines_of(value, width - std::min<std::size_t>(width, 2), indent + 2, shown_unit));
    }
  }
  return text;
}

}  // namespace

std::string lines_text(const Value& group) { return lines_of(group, kLeastWidth, 0, {}); }

}  // namespace touchfield
