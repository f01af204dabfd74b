#include "sim/scene/number_files.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "sim/scene/number_table.h"

namespace touchfield::schema {

namespace {

/// Of columns that only say which row is which.
std::vector<TableColumn> names_of_rows() {
  std::vector<TableColumn> columns;
  for (const char* name : {"id", "index", "no", "nr", "n", "number", "transducer", "element", "name", "label"}) {
    columns.push_back({.name = name, .unit = Unit::power_of_ten(0), .ignored = true});
  }
  return columns;
}

TableForm positions_form() {
  const Unit plain = Unit::power_of_ten(0);
  const Unit millimetres = Unit::power_of_ten(-3);
  const std::string drives =
      "a positions file does not hold it; solve.methods: {fixed: {phases_file}} drives transducers by given phases, "
      "array.calibration: {file} says what each one adds to its drive";
  TableForm form{{{"x_mm", millimetres, {}, true},
                  {"y_mm", millimetres, {}, true},
                  {"z_mm", millimetres},
                  {.name = "nx", .unit = plain, .also = {"ax", "axis_x", "normal_x", "n_x"}},
                  {.name = "ny", .unit = plain, .also = {"ay", "axis_y", "normal_y", "n_y"}},
                  {.name = "nz", .unit = plain, .also = {"az", "axis_z", "normal_z", "n_z"}},
                  {.name = "channel", .unit = plain, .range = at_least(0)},
                  {.name = "alive", .unit = plain, .range = between(0, 1), .also = {"enabled"}},
                  {.name = "dead", .unit = plain, .range = between(0, 1)}},
                 "positions",
                 {3, 6}};
  for (const char* name : {"phase", "phase_rad", "phase_deg", "amplitude", "gain"}) {
    form.known.push_back({.name = name, .unit = plain, .refused = drives});
  }
  std::ranges::move(names_of_rows(), std::back_inserter(form.known));
  return form;
}

/// The axes of a table; nothing if it has none. Reports one of length 0, and a direction of which a part is missing.
std::optional<Points> axes_of(FileReport& report, const NumberTable& table) {
  const char* const names[] = {"nx", "ny", "nz"};
  const auto count = std::ranges::count_if(names, [&](const char* name) { return table.has(name); });
  if (count == 0) {
    return std::nullopt;
  }
  if (count != 3) {
    report.add("the header must name nx, ny and nz, or none of them");
    return std::nullopt;
  }
  Points axes(3, static_cast<Eigen::Index>(table.rows()));
  for (Eigen::Index i = 0; i < 3; ++i) {
    axes.row(i) = Eigen::Map<const Eigen::RowVectorXd>(table.columns.at(names[i]).data(), axes.cols());
  }
  for (Eigen::Index row = 0; row < axes.cols() && !report.full(); ++row) {
    if (axes.col(row).isZero(0)) {
      report.add(table.lines[static_cast<std::size_t>(row)], "the axis must not be zero");
    }
  }
  return axes;
}

/// A row is a channel: those of a table that numbers them must stand in their order.
void check_channels(FileReport& report, const NumberTable& table) {
  if (!table.has("channel")) {
    return;
  }
  const std::vector<double>& channels = table.columns.at("channel");
  for (std::size_t row = 1; row < channels.size() && !report.full(); ++row) {
    if (channels[row] != channels[row - 1] + 1) {
      report.add(
          table.lines[row],
          fmt::format("channel = {:.15g} must be {:.15g}, one above the row before it: rows are channels in their "
                      "order, and alive = 0 marks one that is missing",
                      channels[row], channels[row - 1] + 1));
    }
  }
}

/// Rows of transducers that make no sound.
std::vector<Eigen::Index> dead_of(FileReport& report, const NumberTable& table) {
  if (table.has("alive") && table.has("dead")) {
    report.add("the header must name alive or dead, one of them");
  }
  std::vector<Eigen::Index> dead;
  for (const char* name : {"alive", "dead"}) {
    for (std::size_t row = 0; table.has(name) && row < table.rows() && !report.full(); ++row) {
      const double value = table.columns.at(name)[row];
      if (value != 0.0 && value != 1.0) {
        report.add(table.lines[row], fmt::format("{} = {:.15g} must be 0 or 1", name, value));
      } else if ((value == 0.0) == (name == std::string_view("alive"))) {
        dead.push_back(static_cast<Eigen::Index>(row));
      }
    }
  }
  return dead;
}

/// The numbers of a file that holds nothing else.
///
/// each   what one of them is
std::vector<double> numbers_of(FileReport& report, const Range& range, const char* each) {
  std::vector<double> numbers;
  const auto text = report.text();
  for_each_line(text.value_or(""), [&](int line, std::string_view content) {
    for (const auto part : words(content)) {
      if (report.full()) {
        return;
      }
      const auto value = report.number(line, part);
      const auto rule = value ? range.broken_by(*value) : std::nullopt;
      if (rule) {
        report.add(line, fmt::format("{} = {:.15g} must be {}", each, *value, *rule));
      } else if (value) {
        numbers.push_back(*value);
      }
    }
  });
  if (!report.failed() && numbers.empty()) {
    report.add(fmt::format("no number in it, must hold at least one {}", each));
  }
  return numbers;
}

}  // namespace

std::optional<std::vector<double>> read_phases(const Input& in, const std::string& path) {
  FileReport report(in, path);
  auto phases = numbers_of(report, {}, "phase");
  report.require_few(phases.size(), "phases");
  return report.failed() ? std::nullopt : std::optional(std::move(phases));
}

std::optional<std::vector<double>> read_levels(const Input& in, const std::string& path) {
  FileReport report(in, path, kMostLevelBytes);
  auto levels = numbers_of(report, between(0, 1), "level");
  if (!report.failed() && std::ranges::all_of(levels, [](double level) { return level == 0.0; })) {
    report.add("all levels are 0, one must be > 0");
  }
  return report.failed() ? std::nullopt : std::optional(std::move(levels));
}

std::optional<PositionsFile> read_positions(const Input& in, const std::string& path) {
  FileReport report(in, path);
  const TableForm form = positions_form();
  const auto table = read_number_table(report, form);
  if (!table) {
    return std::nullopt;
  }
  PositionsFile file;
  file.points = Points::Zero(3, static_cast<Eigen::Index>(table->rows()));
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (const auto column = table->columns.find(form.known[static_cast<std::size_t>(i)].name);
        column != table->columns.end()) {
      file.points.row(i) = Eigen::Map<const Eigen::RowVectorXd>(column->second.data(), file.points.cols());
    }
  }
  file.axes = axes_of(report, *table);
  check_channels(report, *table);
  file.dead = dead_of(report, *table);
  return report.failed() ? std::nullopt : std::optional(std::move(file));
}

std::optional<CalibrationFile> read_calibration(const Input& in, const std::string& path, std::size_t channels) {
  const Unit plain = Unit::power_of_ten(0);
  const TableForm form = {{{"channel", plain, at_least(0), true},
                           {"gain", plain, at_least(0), true},
                           {"phase_rad", plain},
                           {"phase_deg", Unit::degree()},
                           {"alive", plain, between(0, 1)}},
                          "channels"};
  FileReport report(in, path);
  const auto table = read_number_table(report, form);
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
