#include "sim/scene/number_table.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/scene/schema_info.h"

namespace touchfield::schema {

namespace {

/// Calls `visit` with the lines of a text, without their ends, and their numbers from 1.
template <class Visit>
void for_each_text_line(std::string_view text, const Visit& visit) {
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    visit(number, line.substr(0, line.size() - (line.ends_with('\r') ? 1 : 0)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

/// A column of a file: what it is, and the unit that the file has it in.
struct FileColumn {
  const TableColumn* known = nullptr;  // null: an index, which is not read
  Unit unit = Unit::power_of_ten(0);
};

/// A known column by the name that a header gives it; nothing if it is another one.
std::optional<FileColumn> as_column(const TableColumn& column, std::string_view name) {
  if (name == column.name) {
    return FileColumn{&column, column.unit};
  }
  constexpr std::pair<const char*, int> kLengths[] = {{"um", -6}, {"mm", -3}, {"cm", -2}, {"m", 0}};
  for (const auto& [unit, power] : kLengths) {
    if (column.length && name == fmt::format("{}_{}", without_unit(column.name), unit)) {
      return FileColumn{&column, Unit::power_of_ten(power)};
    }
  }
  return std::nullopt;
}

FileColumn column_named(const TableForm& form, std::string_view name) {
  std::vector<std::string> names;
  for (const TableColumn& column : form.known) {
    if (const auto found = as_column(column, name)) {
      return *found;
    }
    if (!column.ignored) {
      names.push_back(column.name);
    }
  }
  throw InputError(fmt::format(
      "column '{}' must be one of {}; the first line names the columns, with commas between them, and numbers have a "
      "decimal point",
      quoted_for_message(std::string(name)),
      form.names.empty() ? fmt::format("{}", fmt::join(names, ", ")) : form.names));
}

/// The columns that a header names, in its order.
std::vector<FileColumn> columns_of(const TableForm& form, const Cells& names) {
  std::vector<FileColumn> columns;
  const char* bare = nullptr;  // lengths
  const char* with_unit = nullptr;
  for (const std::string_view name : names) {
    if (name.empty() && columns.empty() && names.size() > 1) {
      columns.emplace_back();
      continue;
    }
    const FileColumn column = column_named(form, name);
    require(std::ranges::find(columns, column.known, &FileColumn::known) == columns.end(), "column {} is there twice",
            column.known->name);
    if (column.known->length) {
      (name == without_unit(column.known->name) ? bare : with_unit) = column.known->name.c_str();
    }
    columns.push_back(column);
  }
  require(bare == nullptr || with_unit == nullptr,
          "the header has {} without a unit and {} with one: name that of both", bare, with_unit);
  for (const TableColumn& column : form.known) {
    require(!column.required || std::ranges::find(columns, &column, &FileColumn::known) != columns.end(),
            "the header must name {}", column.name);
  }
  return columns;
}

/// throws   InputError if a text is not a number in a range
double number_in_range(std::string_view text, std::string_view name, const Range& range) {
  const auto number = parse_decimal(text);
  if (const auto rule = number ? range.broken_by(*number) : std::optional<std::string>("a number, such as -1.5")) {
    throw InputError(fmt::format("{} = {} must be {}{}", name,
                                 text.empty() ? "no value" : quoted_for_message(std::string(text)), *rule,
                                 number ? other_unit(name, *number, range) : ""));
  }
  return *number;
}

/// A value of a column in its SI unit.
double cell_value(const FileColumn& column, std::string_view text) {
  if (column.known->gaps && (text.empty() || text == "nan" || text == "NaN")) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return column.unit.si(number_in_range(text, column.known->name, column.known->range));
}

}  // namespace

void read_table(const std::string& path, std::size_t most_bytes, const std::function<void(const Cells&)>& header,
                const std::function<void(int, const Cells&)>& row) {
  const std::string text = read_text_file(path, most_bytes);
  std::size_t columns = 0;
  char separator = ',';
  for_each_text_line(text, [&](int number, std::string_view line) {
    const std::string_view content = trimmed(without_comment(line));
    const bool comment = content.empty() && columns == 0 && trimmed(line).starts_with('#');
    if (content.empty() && !comment) {
      return;
    }
    try {
      if (columns == 0) {
        const std::string_view written = comment ? trimmed(trimmed(line).substr(1)) : content;
        separator = written.find(',') == std::string_view::npos ? ' ' : ',';
        const Cells names = cells(written, separator);
        header(names);
        columns = names.size();
        return;
      }
      const Cells values = cells(content, separator);
      require(values.size() == columns, "{}, must be {} as in the header", counted(values.size(), "value", "values"),
              columns);
      row(number, values);
    } catch (const InputError& error) {
      if (!comment) {
        throw InputError(fmt::format("{}:{}: {}", path, number, error.what()));
      }
    }
  });
}

NumberTable read_number_table(const std::string& path, const TableForm& form) {
  NumberTable table;
  std::vector<FileColumn> columns;
  read_table(
      path, form.most_bytes, [&](const Cells& names) { columns = columns_of(form, names); },
      [&](int line, const Cells& values) {
        require(table.rows() < form.most, "too many {}, must be at most {}", form.rows, form.most);
        table.lines.push_back(line);
        for (std::size_t i = 0; i < values.size(); ++i) {
          if (columns[i].known != nullptr && !columns[i].known->ignored) {
            table.columns[columns[i].known->name].push_back(cell_value(columns[i], values[i]));
          }
        }
      });
  require(table.rows() > 0, "{}: no {} in it, must hold at least one", path, form.rows);
  return table;
}

void require_rising(const std::string& path, const NumberTable& table, const std::string& column) {
  const std::vector<double>& values = table.columns.at(column);
  const auto fall = std::ranges::adjacent_find(values, [](double one, double next) { return !(next > one); });
  if (fall != values.end()) {
    throw InputError(fmt::format("{}:{}: {} = {:.15g} must be after {:.15g}, that of the row before it", path,
                                 table.lines[static_cast<std::size_t>(fall - values.begin()) + 1], column, *(fall + 1),
                                 *fall));
  }
}

std::vector<double> read_numbers(const std::string& path, const char* each, const Range& range, std::size_t most,
                                 std::size_t most_bytes) {
  const std::string text = read_text_file(path, most_bytes);
  std::vector<double> numbers;
  for_each_text_line(text, [&](int line, std::string_view content) {
    for (const auto word : words(without_comment(content))) {
      try {
        numbers.push_back(number_in_range(word, each, range));
        require(numbers.size() <= most, "too many numbers, must be at most {}", most);
      } catch (const InputError& error) {
        throw InputError(fmt::format("{}:{}: {}", path, line, error.what()));
      }
    }
  });
  require(!numbers.empty(), "{}: no number in it, must hold at least one {}", path, each);
  return numbers;
}

}  // namespace touchfield::schema
