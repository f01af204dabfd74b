#include "sim/scene/number_table.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/whole_file.h"
#include "sim/scene/schema.h"
#include "sim/scene/text_file.h"

namespace touchfield::schema {

namespace {

std::string quoted_value(std::string_view text) {
  return text.empty() ? "no value" : quoted_for_message(std::string(text));
}

/// The columns that a header names, in its order; reports what is wrong with it.
std::vector<const TableColumn*> named_columns(FileReport& report, int line, const std::vector<std::string_view>& parts,
                                              const std::vector<TableColumn>& known) {
  std::vector<const TableColumn*> columns;
  for (const auto part : parts) {
    const auto column = std::ranges::find(known, part, &TableColumn::name);
    if (column == known.end()) {
      std::vector<std::string> names;
      std::ranges::transform(known, std::back_inserter(names), &TableColumn::name);
      report.add(line, fmt::format("column {} must be one of {}", quoted_value(part), fmt::join(names, ", ")));
    } else if (std::ranges::find(columns, &*column) != columns.end()) {
      report.add(line, fmt::format("column {} is there twice", part));
    } else {
      columns.push_back(&*column);
    }
  }
  for (const TableColumn& column : known) {
    if (column.required && !report.failed() && std::ranges::find(columns, &column) == columns.end()) {
      report.add(line, fmt::format("a header with the column {} must come first", column.name));
    }
  }
  return columns;
}

/// A value of a column in its SI unit; reports and returns nothing where it is none.
std::optional<double> cell_value(FileReport& report, int line, const TableColumn& column, std::string_view text) {
  const auto written = parse_decimal(text);
  const auto rule = written ? column.range.broken_by(*written) : std::optional<std::string>("a number");
  if (rule) {
    report.add(line, fmt::format("{} = {} must be {}", column.name, quoted_value(text), *rule));
    return std::nullopt;
  }
  return column.unit.si(text);
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::vector<std::string_view> cells(std::string_view line) {
  std::vector<std::string_view> parts;
  for (std::size_t at = 0; at <= line.size(); at += parts.back().size() + 1) {
    parts.push_back(line.substr(at, line.substr(at).find(',')));
  }
  std::ranges::transform(parts, parts.begin(), trimmed);
  return parts;
}

void FileReport::add(int line, const std::string& text) { report(fmt::format("{}:{}: {}", path_, line, text)); }

void FileReport::add(const std::string& text) { report(fmt::format("{}: {}", path_, text)); }

std::optional<std::string> FileReport::text() {
  try {
    std::string text = read_whole_file(path_, kMostTextBytes);
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    if (text.starts_with(kByteOrderMark)) {
      text.erase(0, kByteOrderMark.size());
    }
    return text;
  } catch (const InputError& error) {
    in_.problem(error.what());
    ++count_;
    return std::nullopt;
  }
}

void FileReport::require_few(std::size_t count, const char* what) {
  if (count > kMostListed) {
    add(fmt::format("{} {}, must be at most {}", count, what, kMostListed));
  }
}

std::optional<double> FileReport::number(int line, std::string_view text, int power) {
  const auto value = parse_decimal(text);
  const auto rule = value ? Range{}.broken_by(*value) : std::optional<std::string>("a number");
  if (!rule) {
    return parse_decimal(text, power);
  }
  add(line, fmt::format("{} must be {}", quoted_value(text), *rule));
  return std::nullopt;
}

void FileReport::report(const std::string& text) {
  in_.reading().add_elsewhere(in_.node().place, text);
  ++count_;
}

std::optional<NumberTable> read_number_table(FileReport& report, const std::vector<TableColumn>& known,
                                             const char* rows) {
  const auto text = report.text();
  if (!text) {
    return std::nullopt;
  }
  NumberTable table;
  std::vector<const TableColumn*> columns;
  for_each_line(*text, [&](int line, std::string_view content) {
    if (trimmed(content).empty() || report.full() || (columns.empty() && report.failed())) {
      return;
    }
    const auto parts = cells(content);
    if (columns.empty()) {
      columns = named_columns(report, line, parts, known);
      return;
    }
    if (parts.size() != columns.size()) {
      report.add(line, fmt::format("{} value{}, must be {} as in the header", parts.size(),
                                   parts.size() == 1 ? "" : "s", columns.size()));
      return;
    }
    table.lines.push_back(line);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (const auto value = cell_value(report, line, *columns[i], parts[i])) {
        table.columns[columns[i]->name].push_back(*value);
      }
    }
  });
  if (!report.failed() && table.rows() == 0) {
    report.add(fmt::format("no {} in it, must hold at least one", rows));
  }
  report.require_few(table.rows(), rows);
  return report.failed() ? std::nullopt : std::optional(std::move(table));
}

}  // namespace touchfield::schema
