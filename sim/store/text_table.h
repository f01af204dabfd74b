#pragma once

#include <cstddef>
#include <string>
#include <vector>

/// Tables for people and CSV files.
namespace touchfield {

/// A line of a CSV file; fields are quoted only where RFC 4180 asks for it.
std::string csv_line(const std::vector<std::string>& fields);

/// As many digits as it takes to read the number back exactly; "nan" where nothing was computed.
std::string csv_number(double value);

/// Rows of equally many columns, as wide as they need, with two spaces before each column. The first column and those
/// in `left` are aligned to the left, the others to the right.
std::string aligned_table(const std::vector<std::vector<std::string>>& rows, const std::vector<std::size_t>& left = {});

/// A number as a table shows it, by fmt's format; "-" where nothing was computed.
std::string table_number(double value, const char* format);

/// 10842 as "10,842".
std::string grouped(long n);

}  // namespace touchfield
