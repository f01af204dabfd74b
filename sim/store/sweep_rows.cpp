#include "sim/store/sweep_rows.h"

#include <algorithm>

#include "sim/core/text_number.h"

namespace touchfield {

std::vector<SweepRow> sweep_rows(const SweepSummary& summary) {
  std::vector<SweepRow> rows;
  for (const SweepRecord& record : summary.records) {
    for (const SweepRecord::Method& method : record.methods) {
      rows.push_back({&record, &method});
    }
    if (record.methods.empty()) {
      rows.push_back({&record, nullptr});
    }
  }
  return rows;
}

std::optional<std::string> input_of(const SweepRecord& record, const std::string& path) {
  const auto found = std::ranges::find(record.inputs, path, &std::pair<std::string, std::string>::first);
  return found != record.inputs.end() ? std::optional(found->second) : std::nullopt;
}

std::optional<std::vector<double>> parameter_numbers(const std::string& path, const std::vector<SweepRow>& rows) {
  std::vector<double> numbers;
  for (const SweepRow& row : rows) {
    const auto text = input_of(*row.record, path);
    const auto number = text ? number_of<double>(*text) : std::optional(kNotComputed);
    if (!number) {
      return std::nullopt;
    }
    numbers.push_back(*number);
  }
  return numbers;
}

}  // namespace touchfield
