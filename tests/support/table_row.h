#pragma once

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace touchfield {

/// Columns of a table and what stands in them; neither holds quotes or backslashes.
using Cells = std::vector<std::pair<std::string, std::string>>;

/// A row of results/tables/TABLE.csv for `scripts/tables hard`, one line: `[TABLE] {"column": "cell", ...}`.
inline void print_row(const std::string& table, const std::vector<Cells>& parts) {
  std::vector<std::string> cells;
  for (const Cells& part : parts) {
    for (const auto& [column, cell] : part) {
      cells.push_back(fmt::format(R"("{}": "{}")", column, cell));
    }
  }
  fmt::print("[{}] {{{}}}\n", table, fmt::join(cells, ", "));
  std::fflush(stdout);
}

}  // namespace touchfield
