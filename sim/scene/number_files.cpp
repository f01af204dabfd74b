#include "sim/scene/number_files.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "sim/scene/number_table.h"

namespace touchfield::schema {

namespace {

constexpr int kMilliPower = -3;

// Parts between commas and white space of any length.
std::vector<std::string_view> words(std::string_view line) {
  constexpr const char* kBetween = ", \t";
  std::vector<std::string_view> parts;
  for (auto first = line.find_first_not_of(kBetween); first != std::string_view::npos;) {
    const auto end = std::min(line.find_first_of(kBetween, first), line.size());
    parts.push_back(line.substr(first, end - first));
    first = line.find_first_not_of(kBetween, end);
  }
  return parts;
}

bool looks_like_header(const std::vector<std::string_view>& parts) {
  return std::ranges::none_of(parts, [](std::string_view part) { return part.empty() || parse_decimal(part); });
}

}  // namespace

std::optional<std::vector<double>> read_phases(const Input& in, const std::string& path) {
  FileReport report(in, path);
  const auto text = report.text();
  if (!text) {
    return std::nullopt;
  }
  std::vector<double> phases;
  for_each_line(*text, [&](int number, std::string_view line) {
    for (const auto part : words(line)) {
      if (report.full()) {
        return;
      }
      if (const auto value = report.number(number, part)) {
        phases.push_back(*value);
      }
    }
  });
  if (!report.failed() && phases.empty()) {
    report.add("no number in it, must hold at least one phase");
  }
  report.require_few(phases.size(), "phases");
  if (report.failed()) {
    return std::nullopt;
  }
  return phases;
}

std::optional<PositionsFile> read_positions(const Input& in, const std::string& path) {
  FileReport report(in, path);
  const auto text = report.text();
  if (!text) {
    return std::nullopt;
  }
  std::vector<double> values;
  std::size_t columns = 0;
  bool first = true;
  for_each_line(*text, [&](int number, std::string_view line) {
    if (trimmed(line).empty() || report.full()) {
      return;
    }
    const auto parts = cells(line);
    const bool header = first && looks_like_header(parts);
    first = false;
    if (header) {
      return;
    }
    if (parts.size() != 3 && parts.size() != 6) {
      report.add(number, fmt::format("{} value{}, must be 3 or 6", parts.size(), parts.size() == 1 ? "" : "s"));
      return;
    }
    if (columns == 0) {
      columns = parts.size();
    }
    if (parts.size() != columns) {
      report.add(number, fmt::format("{} values, must be {} as in the first line", parts.size(), columns));
      return;
    }
    bool zero_axis = columns == 6;
    for (std::size_t i = 0; i < columns; ++i) {
      const auto value = report.number(number, parts[i], i < 3 ? kMilliPower : 0);
      if (value) {
        values.push_back(*value);
      }
      if (i >= 3 && value != 0.0) {
        zero_axis = false;
      }
    }
    if (zero_axis) {
      report.add(number, "the axis must not be zero");
    }
  });
  if (!report.failed() && columns == 0) {
    report.add("no position in it, must hold at least one");
  }
  report.require_few(columns == 0 ? 0 : values.size() / columns, "positions");
  if (report.failed() || columns == 0) {
    return std::nullopt;
  }

  const auto rows = static_cast<Eigen::Index>(values.size() / columns);
  const Eigen::Map<const Eigen::MatrixXd> table(values.data(), static_cast<Eigen::Index>(columns), rows);
  PositionsFile file;
  file.points = table.topRows(3);
  if (columns == 6) {
    file.axes = table.bottomRows(3);
  }
  return file;
}

std::optional<CalibrationFile> read_calibration(const Input& in, const std::string& path, std::size_t channels) {
  const Unit plain = Unit::power_of_ten(0);
  const std::vector<TableColumn> known = {{"channel", plain, at_least(0), true},
                                          {"gain", plain, at_least(0), true},
                                          {"phase_rad", plain, {}},
                                          {"phase_deg", Unit::degree(), {}},
                                          {"alive", plain, between(0, 1)}};
  FileReport report(in, path);
  const auto table = read_number_table(report, known, "channels");
  if (!table) {
    return std::nullopt;
  }
  if (table->has("phase_rad") == table->has("phase_deg")) {
    report.add("the header must name phase_rad or phase_deg, one of them");
    return std::nullopt;
  }
  const auto& phases = table->columns.at(table->has("phase_rad") ? "phase_rad" : "phase_deg");
  CalibrationFile file{std::vector<double>(channels), std::vector<double>(channels)};
  std::vector<int> line_of(channels, 0);
  for (std::size_t row = 0; row < table->rows() && !report.full(); ++row) {
    const int line = table->lines[row];
    const double number = table->columns.at("channel")[row];
    const double alive = table->has("alive") ? table->columns.at("alive")[row] : 1.0;
    if (number != std::floor(number) || number >= static_cast<double>(channels)) {
      report.add(line, fmt::format("channel = {:.15g} must be an integer from 0 to {}, the array has {} channel{}",
                                   number, channels - 1, channels, channels == 1 ? "" : "s"));
      continue;
    }
    const auto channel = static_cast<std::size_t>(number);
    if (line_of[channel] != 0) {
      report.add(line, fmt::format("channel = {} is in line {} already", channel, line_of[channel]));
    }
    if (alive != 0.0 && alive != 1.0) {
      report.add(line, fmt::format("alive = {:.15g} must be 0 or 1", alive));
    }
    line_of[channel] = line;
    file.gain[channel] = alive * table->columns.at("gain")[row];
    file.phase[channel] = phases[row];
  }
  const auto missing = std::ranges::count(line_of, 0);
  if (!report.failed() && missing > 0) {
    const auto first = std::ranges::find(line_of, 0) - line_of.begin();
    report.add(table->lines.back(),
               fmt::format("the last row, and {} of the array's {} channels {} missing, the first is {}", missing,
                           channels, missing == 1 ? "is" : "are", first));
  }
  return report.failed() ? std::nullopt : std::optional(std::move(file));
}

}  // namespace touchfield::schema
