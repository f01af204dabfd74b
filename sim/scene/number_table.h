#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/scene/input.h"
#include "sim/scene/quantity.h"

/// What files of numbers have in common: lines, # for comments, cells between commas, and how their faults are named.
namespace touchfield::schema {

/// A text without the blanks at its ends.
std::string_view trimmed(std::string_view text);

/// Parts between single commas.
std::vector<std::string_view> cells(std::string_view line);

/// Lines of a text without comments and end marks, with their numbers from 1.
template <class Visit>
void for_each_line(std::string_view text, const Visit& visit) {
  for (int number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (!line.empty() && line.back() == '\r') {
      line.remove_suffix(1);
    }
    visit(number, line.substr(0, line.find('#')));
  }
}

/// Reports what is wrong with a file; stops after a few lines, since the rest is usually wrong in the same way.
class FileReport {
 public:
  /// in     the value that names the file; it and the path outlive this
  FileReport(const Input& in, const std::string& path) : in_(in), path_(path) {}
  FileReport(const Input&&, const std::string&) = delete;
  FileReport(const Input&, const std::string&&) = delete;

  bool failed() const { return count_ > 0; }
  bool full() const { return count_ >= kMost; }
  void add(int line, const std::string& text);
  void add(const std::string& text);

  /// What is in the file, without a byte order mark; reports and returns nothing if it cannot be read.
  std::optional<std::string> text();
  void require_few(std::size_t count, const char* what);
  /// A number within the bounds every number of a scene has; reports and returns nothing otherwise.
  std::optional<double> number(int line, std::string_view text, int power = 0);

 private:
  static constexpr int kMost = 10;

  void report(const std::string& text);

  const Input& in_;
  const std::string& path_;
  int count_ = 0;
};

/// A column that a table may have.
struct TableColumn {
  std::string name;
  Unit unit;
  Range range{};
  bool required = false;
};

/// Rows of numbers by the names in the header, in SI units.
struct NumberTable {
  std::vector<int> lines;                              // of the rows
  std::map<std::string, std::vector<double>> columns;  // a value a row; those that the file has

  bool has(const std::string& name) const { return columns.contains(name); }
  std::size_t rows() const { return lines.size(); }
};

/// A table whose first line names its columns, in any order, and whose others hold a number for each.
///
/// rows      how messages call what a row is, in the plural
/// returns   nothing after a report: a column that is unknown, missing or there twice, a row of another length, what is
///           no number or out of its range
std::optional<NumberTable> read_number_table(FileReport& report, const std::vector<TableColumn>& known,
                                             const char* rows);

}  // namespace touchfield::schema
