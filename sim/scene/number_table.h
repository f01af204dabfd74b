#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/core/text_number.h"
#include "sim/scene/input.h"
#include "sim/scene/quantity.h"
#include "sim/scene/schema.h"
#include "sim/scene/text_file.h"

/// What files of numbers have in common: lines, # for comments, cells between commas, and how their faults are named.
namespace touchfield::schema {

/// Lines of a text without end marks, each with its number from 1, what is before a # and what is behind it.
template <class Visit>
void for_each_commented_line(std::string_view text, const Visit& visit) {
  for_each_text_line(text, [&](int number, std::string_view line) {
    const std::string_view content = without_comment(line);
    visit(number, content, line.substr(std::min(content.size() + 1, line.size())));
  });
}

/// The same without comments.
template <class Visit>
void for_each_line(std::string_view text, const Visit& visit) {
  for_each_commented_line(text, [&](int number, std::string_view line, std::string_view) { visit(number, line); });
}

/// Reports what is wrong with a file; stops after a few lines, since the rest is usually wrong in the same way.
class FileReport {
 public:
  /// in     the value that names the file; it and the path outlive this
  /// most   bytes that it may have
  FileReport(const Input& in, const std::string& path, std::size_t most = kMostTextBytes)
      : in_(in), path_(path), most_(most) {}
  FileReport(const Input&&, const std::string&, std::size_t = 0) = delete;
  FileReport(const Input&, const std::string&&, std::size_t = 0) = delete;

  bool failed() const { return count_ > 0; }
  bool full() const { return count_ >= kMost; }
  void add(int line, const std::string& text);
  void add(const std::string& text);

  /// What is in the file, without a byte order mark; reports and returns nothing if it cannot be read or is no text.
  std::optional<std::string> text();
  void require_few(std::size_t count, const char* what, std::size_t most = kMostListed);
  /// A number within the bounds every number of a scene has; reports and returns nothing otherwise.
  std::optional<double> number(int line, std::string_view text);

 private:
  static constexpr int kMost = 10;

  void report(const std::string& text);

  const Input& in_;
  const std::string& path_;
  std::size_t most_;
  int count_ = 0;
};

/// A column that a table may have.
struct TableColumn {
  std::string name;  // with its unit, if it has one: x_mm, phase_rad
  Unit unit;
  Range range{};
  bool required = false;
  std::vector<std::string> also{};  // other names of it, without their unit: ax for nx
  bool ignored = false;             // read past, whatever it holds
  bool gaps = false;                // no value, or nan, is NaN
  std::string refused{};            // why a table of this kind cannot hold it, and what does
};

/// Rows of numbers by the names in the header, in SI units.
struct NumberTable {
  std::vector<int> lines;  // of the rows
  std::map<std::string, std::vector<double>>
      columns;  // by their known names: one value per row; those that the file has

  bool has(const std::string& name) const { return columns.contains(name); }
  std::size_t rows() const { return lines.size(); }
};

/// What a kind of table holds.
struct TableForm {
  std::vector<TableColumn> known;
  const char* rows;  // how messages call what a row is, in the plural
  /// How many columns a table without a header may have: so many of the known ones, in their order. Empty: a header
  /// must come first. Names of lengths then mean their known unit where they have none: x is x_mm.
  std::vector<std::size_t> without_header{};
  std::string names{};  // how messages list the columns; empty: all their names
  std::size_t most = kMostListed;
};

/// A table with the names of its columns in the first line, in any order. Every other line holds a number for each.
///
/// Names count whatever their case and quotes. A unit is written as x_mm, x mm, x (mm), x [mm] or x/mm. Lengths may be
/// in um, mm, cm or m, each column in its own. A first column without a name is an index. Cells stand between
/// semicolons, else commas, else tabs, else blanks, whichever the first line has.
///
/// The header may also be a comment before the first row. It must have as many words as that row and name all columns
/// that are required. The last such comment counts.
///
/// returns   nothing after a report: a column that is unknown, missing or there twice, lengths with and without units,
///           a row of another length, a cell that is not a number or out of its range
std::optional<NumberTable> read_number_table(FileReport& report, const TableForm& form);

}  // namespace touchfield::schema
