#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "sim/core/json.h"

/// What a program says as text for people, and as CSV files. A word of a name may be a unit, as in `residual_mm`: text
/// shows it behind the number, metres as mm, radians as deg. Words like `error` or `share` tell a part of a whole,
/// which text shows in percent. JSON has every digit.
namespace touchfield {

/// Rows of equally many columns, as wide as they need, with two spaces before each column. The first column and those
/// in `left` are aligned to the left, the others to the right.
std::string aligned_table(const std::vector<std::vector<std::string>>& rows, const std::vector<std::size_t>& left = {});

/// A number as a table shows it, by fmt's format; "-" where nothing was computed.
std::string table_number(double value, const char* format);

/// 10842 as "10,842".
std::string grouped(long n);

/// A value in one line, an object as "label value, ...".
///
/// name   says its unit
std::string value_text(const Json& value, std::string_view name = {});

/// An array of objects, a column for every name that has something in a row.
std::string table_text(const Json& rows, std::size_t most = 40);

/// A CSV file: the names of one object, and the values of others like it, a line each; flags as 1 and 0.
std::string csv_text(const Json& columns, const Json& rows);

/// A line for every entry of an object, "label  value", long objects indented; an array of objects as a table; nothing
/// for what is null or empty.
std::string lines_text(const Json& object);

/// Writes text to a file, whole or not at all.
void write_text_file(const std::string& path, const std::string& text);

}  // namespace touchfield
