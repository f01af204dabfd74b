#include "sim/scene/number_table.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/whole_file.h"
#include "sim/scene/schema.h"
#include "sim/scene/suggest.h"
#include "sim/scene/text_file.h"

namespace touchfield::schema {

namespace {

std::string quoted_value(std::string_view text) {
  return text.empty() ? "no value" : quoted_for_message(std::string(text));
}

std::string_view unquoted(std::string_view text) {
  const bool quoted = text.size() > 1 && text.front() == text.back() && (text.front() == '"' || text.front() == '\'');
  return quoted ? trimmed(text.substr(1, text.size() - 2)) : text;
}

/// What stands between the cells of a table, by its first line.
char separator_of(std::string_view line) {
  for (const char separator : {';', ',', '\t'}) {
    if (line.find(separator) != std::string_view::npos) {
      return separator;
    }
  }
  return ' ';
}

/// The name of a column as the known ones are written: "X [mm]", "x (mm)", "x/mm" and "x mm" are x_mm.
std::string plain_name(std::string_view written) {
  std::string name;
  for (const char c : unquoted(written)) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    const bool capital = c >= 'A' && c <= 'Z';
    if (letter || capital) {
      name += capital ? static_cast<char>(c - 'A' + 'a') : c;
    } else if (std::string_view(" _([/.-").find(c) != std::string_view::npos) {
      name += name.ends_with('_') ? "" : "_";
    } else if (c != ')' && c != ']') {
      name += c;
    }
  }
  name.erase(name.find_last_not_of('_') + 1);
  return name;
}

/// A column of a file: what it is, and the unit that the file has it in.
struct FileColumn {
  const TableColumn* known;  // null: an index, which is not read
  Unit unit;
};

constexpr std::pair<std::string_view, int> kLengths[] = {{"_um", -6}, {"_mm", -3}, {"_cm", -2}, {"_m", 0}};

/// A known length in the unit that a file names; nothing if it is another column.
std::optional<FileColumn> as_length(const TableColumn& column, const std::string& name, bool bare_names) {
  const std::string stem(without_unit(column.name));
  if (stem + "_mm" != column.name && stem + "_m" != column.name) {
    return std::nullopt;
  }
  if (bare_names && name == stem) {
    return FileColumn{&column, column.unit};
  }
  for (const auto& [ending, power] : kLengths) {
    if (name == stem + std::string(ending)) {
      return FileColumn{&column, Unit::power_of_ten(power)};
    }
  }
  return std::nullopt;
}

std::optional<FileColumn> column_named(const TableForm& form, const std::string& name) {
  for (const TableColumn& column : form.known) {
    if (name == column.name || std::ranges::find(column.also, name) != column.also.end()) {
      return FileColumn{&column, column.unit};
    }
    if (const auto length = as_length(column, name, !form.without_header.empty())) {
      return length;
    }
  }
  return std::nullopt;
}

/// The names that a message lists.
std::string listed_names(const TableForm& form) {
  if (!form.names.empty()) {
    return form.names;
  }
  std::vector<std::string> names;
  for (const TableColumn& column : form.known) {
    if (column.refused.empty() && !column.ignored) {
      names.push_back(column.name);
    }
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

/// What a header leaves out, and lengths of which some have a unit and others do not.
void check_header(FileReport& report, int line, const TableForm& form, const std::vector<std::string_view>& parts,
                  const std::vector<FileColumn>& columns) {
  for (const TableColumn& column : form.known) {
    if (column.required && std::ranges::find(columns, &column, &FileColumn::known) == columns.end()) {
      report.add(line, fmt::format("a header with the column {} must come first", column.name));
    }
  }
  std::string bare;
  std::string with_unit;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].known != nullptr && as_length(*columns[i].known, columns[i].known->name, false)) {
      const bool has_unit = plain_name(parts[i]) != without_unit(columns[i].known->name);
      (has_unit ? with_unit : bare) = std::string(unquoted(parts[i]));
    }
  }
  if (!bare.empty() && !with_unit.empty()) {
    report.add(line, fmt::format("column {} has no unit and {} has one: name that of both", quoted_value(bare),
                                 quoted_value(with_unit)));
  }
}

/// The columns that a header names, in its order; reports what is wrong with it.
std::vector<FileColumn> named_columns(FileReport& report, int line, const std::vector<std::string_view>& parts,
                                      const TableForm& form) {
  std::vector<FileColumn> columns;
  for (const auto part : parts) {
    const std::string name = plain_name(part);
    if (name.empty() && columns.empty() && parts.size() > 1) {
      columns.push_back({nullptr, Unit::power_of_ten(0)});
      continue;
    }
    const auto column = column_named(form, name);
    if (!column) {
      report.add(line, fmt::format("column {} must be one of {}", name.empty() ? "without a name" : quoted_value(part),
                                   listed_names(form)));
    } else if (!column->known->refused.empty()) {
      report.add(line, fmt::format("column {}: {}", quoted_value(unquoted(part)), column->known->refused));
    } else if (!column->known->ignored &&
               std::ranges::find(columns, column->known, &FileColumn::known) != columns.end()) {
      report.add(line, fmt::format("column {} is there twice", column->known->name));
    } else {
      columns.push_back(*column);
    }
  }
  if (!report.failed()) {
    check_header(report, line, form, parts, columns);
  }
  return columns;
}

using Comments = std::vector<std::pair<int, std::string_view>>;  // by their lines

/// A header in a comment.
struct CommentedHeader {
  int line;
  std::vector<std::string_view> parts;
};

/// The last comment with so many words that names what the table needs.
std::optional<CommentedHeader> commented_header(const TableForm& form, const Comments& comments, std::size_t count) {
  for (auto comment = comments.rbegin(); comment != comments.rend(); ++comment) {
    const CommentedHeader header{comment->first, cells(comment->second, separator_of(comment->second))};
    const auto names = [&](const TableColumn& column) {
      return !column.required || std::ranges::any_of(header.parts, [&](std::string_view part) {
        const auto named = column_named(form, plain_name(part));
        return named && named->known == &column;
      });
    };
    if (header.parts.size() == count && std::ranges::all_of(form.known, names)) {
      return header;
    }
  }
  return std::nullopt;
}

/// A value of a column in its SI unit; reports and returns nothing where it is none.
std::optional<double> cell_value(FileReport& report, int line, const FileColumn& column, std::string_view text) {
  const std::string_view number = unquoted(text);
  if (column.known->gaps && (number.empty() || plain_name(number) == "nan")) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto written = parse_decimal(number);
  const auto rule = written ? column.known->range.broken_by(*written) : std::optional<std::string>("a number");
  if (rule) {
    const bool comma = number.find(',') != std::string_view::npos;
    report.add(line, fmt::format("{} = {} must be {}{}", column.known->name, quoted_value(number), *rule,
                                 comma ? " with a point, not a comma" : ""));
    return std::nullopt;
  }
  return column.unit.si(number);
}

/// Whether a line names columns: none of its cells is a number, and at least one has a name.
bool is_header(const std::vector<std::string_view>& parts) {
  return std::ranges::none_of(parts, [](std::string_view part) { return parse_decimal(unquoted(part)).has_value(); }) &&
         std::ranges::any_of(parts, [](std::string_view part) { return !unquoted(part).empty(); });
}

/// Reads a table line by line.
class TableReader {
 public:
  TableReader(FileReport& report, const TableForm& form) : report_(report), form_(form) {}

  void line(int number, std::string_view content, std::string_view comment) {
    if (trimmed(content).empty()) {
      if (columns_.empty() && !trimmed(comment).empty()) {
        comments_.emplace_back(number, trimmed(comment));
      }
      return;
    }
    if (report_.full() || (columns_.empty() && report_.failed())) {
      return;
    }
    if (columns_.empty()) {
      separator_ = separator_of(trimmed(content));
    }
    const auto parts = cells(content, separator_);
    if (columns_.empty() && !begins_with_row(number, parts)) {
      return;
    }
    if (parts.size() != columns_.size()) {
      report_.add(number, fmt::format("{} value{}, must be {} as in the {}", parts.size(), parts.size() == 1 ? "" : "s",
                                      columns_.size(), like_));
      return;
    }
    table_.lines.push_back(number);
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const TableColumn* known = columns_[i].known;
      if (known == nullptr || known->ignored) {
        continue;
      }
      if (const auto value = cell_value(report_, number, columns_[i], parts[i])) {
        table_.columns[known->name].push_back(*value);
      }
    }
  }

  NumberTable table() { return std::move(table_); }

 private:
  /// Finds the columns; whether the first line is a row of them already.
  bool begins_with_row(int number, const std::vector<std::string_view>& parts) {
    if (is_header(parts)) {
      take_header(number, parts);
      return false;
    }
    if (const auto header = commented_header(form_, comments_, parts.size())) {
      take_header(header->line, header->parts);
      return !columns_.empty();
    }
    const std::vector<std::size_t>& counts = form_.without_header;
    if (counts.empty()) {
      take_header(number, parts);  // which says that one is missing
      return false;
    }
    if (std::ranges::find(counts, parts.size()) == counts.end()) {
      report_.add(number, fmt::format("{} value{}, must be {}, or a header must name the columns: {}", parts.size(),
                                      parts.size() == 1 ? "" : "s", fmt::join(counts, " or "), listed_names(form_)));
      return false;
    }
    for (std::size_t i = 0; i < parts.size(); ++i) {
      columns_.push_back({&form_.known[i], form_.known[i].unit});
    }
    like_ = "first line";
    return true;
  }

  /// Rows below a header with faults are not looked at.
  void take_header(int line, const std::vector<std::string_view>& parts) {
    columns_ = named_columns(report_, line, parts, form_);
    if (report_.failed()) {
      columns_.clear();
    }
  }

  FileReport& report_;
  const TableForm& form_;
  NumberTable table_;
  std::vector<FileColumn> columns_;
  Comments comments_;  // before the first row
  char separator_ = ',';
  const char* like_ = "header";
};

}  // namespace

void FileReport::add(int line, const std::string& text) { report(fmt::format("{}:{}: {}", path_, line, text)); }

void FileReport::add(const std::string& text) { report(fmt::format("{}: {}", path_, text)); }

std::optional<std::string> FileReport::text() {
  try {
    return read_text_file(path_, most_);
  } catch (const InputError& error) {
    in_.problem(error.what());
    ++count_;
    return std::nullopt;
  }
}

void FileReport::require_few(std::size_t count, const char* what, std::size_t most) {
  if (count > most) {
    add(fmt::format("{} {}, must be at most {}", count, what, most));
  }
}

std::optional<double> FileReport::number(int line, std::string_view text) {
  const auto value = parse_decimal(text);
  const auto rule = value ? Range{}.broken_by(*value) : std::optional<std::string>("a number");
  if (!rule) {
    return value;
  }
  add(line, fmt::format("{} must be {}", quoted_value(text), *rule));
  return std::nullopt;
}

void FileReport::report(const std::string& text) {
  in_.reading().add_elsewhere(in_.node().place, text);
  ++count_;
}

std::optional<NumberTable> read_number_table(FileReport& report, const TableForm& form) {
  const auto text = report.text();
  if (!text) {
    return std::nullopt;
  }
  TableReader reader(report, form);
  for_each_commented_line(*text, [&](int line, std::string_view content, std::string_view comment) {
    reader.line(line, content, comment);
  });
  NumberTable table = reader.table();
  if (!report.failed() && table.rows() == 0) {
    report.add(fmt::format("no {} in it, must hold at least one", form.rows));
  }
  report.require_few(table.rows(), form.rows, form.most);
  return report.failed() ? std::nullopt : std::optional(std::move(table));
}

}  // namespace touchfield::schema
