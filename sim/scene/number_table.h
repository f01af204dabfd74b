#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sim/scene/input.h"
#include "sim/scene/quantity.h"
#include "sim/scene/schema.h"
#include "sim/scene/yaml_tree.h"

/// Tables of files: a header that names the columns, then rows. # starts a comment.
namespace touchfield::schema {

using Cells = std::vector<std::string_view>;

/// Reads a table line by line. Cells stand between commas, or between blanks and tabs if the header has no comma. The
/// header is the first line that is not a comment, or a comment before it that `header` takes (numpy.savetxt).
///
/// header   is given its names, and throws InputError if they are not those of a table
/// row      is given the number of a line and as many cells as the header has
/// throws   InputError "path:line: what" for theirs, and for a row of another length; as read_text_file
void read_table(const std::string& path, std::size_t most_bytes, const std::function<void(const Cells&)>& header,
                const std::function<void(int, const Cells&)>& row);

/// A column that a table may have.
struct TableColumn {
  std::string name;  // with its unit, if it has one: x_mm, phase_rad
  Unit unit;
  Range range{};
  bool required = false;
  bool length = false;   // the header may have it in another unit: um, mm, cm or m
  bool ignored = false;  // read past, whatever it holds
  bool gaps = false;     // no value, or nan, is NaN
};

/// What a kind of table holds.
struct TableForm {
  std::vector<TableColumn> known;
  const char* rows;     // how messages call what a row is, in the plural
  std::string names{};  // how messages list the columns; empty: all their names
  std::size_t most = kMostListed;
  std::size_t most_bytes = kMostTextBytes;
};

/// Rows of numbers in SI units, by the known names of the columns that the file has.
struct NumberTable {
  std::vector<int> lines;  // of the rows
  std::map<std::string, std::vector<double>> columns;

  bool has(const std::string& name) const { return columns.contains(name); }
  std::size_t rows() const { return lines.size(); }
};

/// Reads a table whose header has known names in any order. A first column without a name is an index.
///
/// throws   InputError naming file and line: a column that is unknown, missing or there twice, lengths with and without
///          units, a cell that is not a number or out of its range, no row or too many; as read_table
NumberTable read_number_table(const std::string& path, const TableForm& form);

/// throws   InputError "path:line: ..." where a column does not rise
void require_rising(const std::string& path, const NumberTable& table, const std::string& column);

/// The numbers of a text file that holds nothing else, separated by commas, blanks and ends of lines.
///
/// each     what one of them is, for messages
/// throws   InputError "path:line: each = value must be rule"; if there is none or more than `most`
std::vector<double> read_numbers(const std::string& path, const char* each, const Range& range, std::size_t most,
                                 std::size_t most_bytes = kMostTextBytes);

}  // namespace touchfield::schema
