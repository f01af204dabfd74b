#include "sim/scene/number_files.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/scene/number_table.h"

namespace touchfield::schema {

namespace {

const Unit kPlainColumn = Unit::power_of_ten(0);

TableForm positions_form() {
  const Unit millimetres = Unit::power_of_ten(-3);
  return {{{.name = "x_mm", .unit = millimetres, .required = true, .length = true},
           {.name = "y_mm", .unit = millimetres, .required = true, .length = true},
           {.name = "z_mm", .unit = millimetres, .length = true},
           {.name = "nx", .unit = kPlainColumn},
           {.name = "ny", .unit = kPlainColumn},
           {.name = "nz", .unit = kPlainColumn},
           {.name = "channel", .unit = kPlainColumn, .range = at_least(0)},
           {.name = "alive", .unit = kPlainColumn, .range = between(0, 1)},
           {.name = "dead", .unit = kPlainColumn, .range = between(0, 1)},
           {.name = "id", .unit = kPlainColumn, .ignored = true},
           {.name = "name", .unit = kPlainColumn, .ignored = true}},
          "positions"};
}

/// Columns of a table as the rows of a matrix; zeros for one that it has not.
Points points_of(const NumberTable& table, const std::array<const char*, 3>& names) {
  Points points = Points::Zero(3, static_cast<Eigen::Index>(table.rows()));
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (const auto column = table.columns.find(names[static_cast<std::size_t>(i)]); column != table.columns.end()) {
      points.row(i) = Eigen::Map<const Eigen::RowVectorXd>(column->second.data(), points.cols());
    }
  }
  return points;
}

/// The value of a row in a column of 0 and 1.
bool is_set(const std::string& path, const NumberTable& table, const std::string& column, std::size_t row) {
  const double value = table.columns.at(column)[row];
  require(value == 0.0 || value == 1.0, "{}:{}: {} = {:.15g} must be 0 or 1", path, table.lines[row], column, value);
  return value == 1.0;
}

}  // namespace

std::vector<double> read_phases(const std::string& path) { return read_numbers(path, "phase", {}, kMostListed); }

std::vector<double> read_levels(const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{64} << 20U;  // of five million faces, 12 bytes each
  auto levels = read_numbers(path, "level", between(0, 1), kMostBytes, kMostBytes);
  require(std::ranges::any_of(levels, [](double level) { return level > 0.0; }),
          "{}: all levels are 0, one must be > 0", path);
  return levels;
}

PositionsFile read_positions(const std::string& path) {
  const NumberTable table = read_number_table(path, positions_form());
  PositionsFile file{points_of(table, {"x_mm", "y_mm", "z_mm"}), std::nullopt};
  const int directions = int{table.has("nx")} + int{table.has("ny")} + int{table.has("nz")};
  require(directions == 0 || directions == 3, "{}: the header must name nx, ny and nz, or none of them", path);
  if (directions == 3) {
    file.axes = points_of(table, {"nx", "ny", "nz"});
  }
  require(!table.has("alive") || !table.has("dead"), "{}: the header must name alive or dead, one of them", path);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto index = static_cast<Eigen::Index>(row);
    require(!file.axes || !file.axes->col(index).isZero(0), "{}:{}: the axis must not be zero", path, table.lines[row]);
    if (table.has("channel") && row > 0) {
      const std::vector<double>& channels = table.columns.at("channel");
      require(
          channels[row] == channels[row - 1] + 1,
          "{}:{}: channel = {:.15g} must be {:.15g}, one above the row before it: rows are channels in their order, "
          "and alive = 0 marks one that is missing",
          path, table.lines[row], channels[row], channels[row - 1] + 1);
    }
    if ((table.has("alive") && !is_set(path, table, "alive", row)) ||
        (table.has("dead") && is_set(path, table, "dead", row))) {
      file.dead.push_back(index);
    }
  }
  return file;
}

CalibrationFile read_calibration(const std::string& path, std::size_t channels) {
  const NumberTable table =
      read_number_table(path, {{{.name = "channel", .unit = kPlainColumn, .range = at_least(0), .required = true},
                                {.name = "gain", .unit = kPlainColumn, .range = between(0, 10), .required = true},
                                {.name = "phase_rad", .unit = kPlainColumn},
                                {.name = "phase_deg", .unit = Unit::degree()},
                                {.name = "alive", .unit = kPlainColumn, .range = between(0, 1)}},
                               "channels"});
  require(table.has("phase_rad") != table.has("phase_deg"),
          "{}: the header must name phase_rad or phase_deg, one of them", path);
  const auto& phases = table.columns.at(table.has("phase_rad") ? "phase_rad" : "phase_deg");
  CalibrationFile file{std::vector<double>(channels), std::vector<double>(channels)};
  std::vector<int> line_of(channels, 0);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const int line = table.lines[row];
    const double number = table.columns.at("channel")[row];
    require(number == std::floor(number) && number < static_cast<double>(channels),
            "{}:{}: channel = {:.15g} must be an integer from 0 to {}, the array has {}", path, line, number,
            channels - 1, counted(static_cast<std::int64_t>(channels), "channel", "channels"));
    const auto channel = static_cast<std::size_t>(number);
    require(line_of[channel] == 0, "{}:{}: channel = {} is in line {} already", path, line, channel, line_of[channel]);
    line_of[channel] = line;
    const bool alive = !table.has("alive") || is_set(path, table, "alive", row);
    file.gain[channel] = alive ? table.columns.at("gain")[row] : 0.0;
    file.phase[channel] = phases[row];
  }
  const auto missing = std::ranges::find(line_of, 0);
  require(missing == line_of.end(), "{}: channel {} is missing; the array has {}", path, missing - line_of.begin(),
          counted(static_cast<std::int64_t>(channels), "channel", "channels"));
  return file;
}

}  // namespace touchfield::schema

namespace touchfield {

namespace {

constexpr std::size_t kMostPoints = 1'000'000;  // a robot scans what nobody would type
constexpr std::size_t kMostBytes = std::size_t{64} << 20U;

}  // namespace

MeasuredPoints read_measured_points(const std::string& path) {
  using schema::Unit;
  const Unit millimetres = Unit::power_of_ten(-3);
  const Unit plain = Unit::power_of_ten(0);
  const schema::NumberTable table = schema::read_number_table(
      path, {.known = {{.name = "x_mm", .unit = millimetres, .required = true, .length = true},
                       {.name = "y_mm", .unit = millimetres, .required = true, .length = true},
                       {.name = "z_mm", .unit = millimetres, .required = true, .length = true},
                       {.name = "p_pa", .unit = plain, .range = schema::at_least(0)},
                       {.name = "p_re", .unit = plain},
                       {.name = "p_im", .unit = plain}},
             .rows = "points",
             .most = kMostPoints,
             .most_bytes = kMostBytes});
  const bool complex = table.has("p_re");
  require(complex != table.has("p_pa") && complex == table.has("p_im"),
          "{}: the header must name p_pa, or p_re and p_im", path);
  const auto column = [&](const char* name) {
    const std::vector<double>& values = table.columns.at(name);
    return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  };
  MeasuredPoints measured;
  measured.lines = table.lines;
  measured.complex = complex;
  measured.points.resize(3, static_cast<Eigen::Index>(table.rows()));
  measured.points.row(0) = column("x_mm").transpose();
  measured.points.row(1) = column("y_mm").transpose();
  measured.points.row(2) = column("z_mm").transpose();
  measured.pressure = (complex ? column("p_re") : column("p_pa")).cast<Complex>();
  if (complex) {
    measured.pressure += Complex(0, 1) * column("p_im");
  }
  return measured;
}

}  // namespace touchfield

namespace touchfield::schema {

namespace {

namespace fs = std::filesystem;

/// A row of the table.
/// throws   InputError without the place
MeshSeries::Mesh mesh_of(const MeshSeries& series, std::string_view file, std::string_view time) {
  const auto seconds = parse_decimal(time);
  const auto rule = seconds ? Range{}.broken_by(*seconds) : std::optional<std::string>("a number, such as 1.5");
  if (rule) {
    throw InputError(fmt::format("time_s = {} must be {}", quoted_for_message(std::string(time)), *rule));
  }
  const std::string path = (fs::path(series.folder) / file).lexically_normal().string();
  std::error_code none;
  require(!file.empty() && fs::is_regular_file(path, none), "file = {} must be that of a mesh in meshes.folder",
          file.empty() ? "no value" : quoted_for_message(std::string(file)));
  const double before = series.meshes.empty() ? -Range::kLargest : series.meshes.back().seconds;
  require(series.meshes.empty() || *seconds > before,
          "time_s = {:.15g} must be after {:.15g}, that of the row before it", *seconds, before);
  return {path, *seconds};
}

}  // namespace

bool read_mesh_times(const Input& in, MeshShape& mesh) {
  MeshSeries& series = *mesh.series;
  if (std::error_code none; !fs::is_directory(series.folder, none)) {
    return in.key("folder").problem(fmt::format("{} must be a folder", series.folder));
  }
  const auto read = read_named(in.key("times"), [&] {
    std::size_t time = 0;
    read_table(
        series.times, kMostTextBytes,
        [&](const Cells& names) {
          time = names.front() == "time_s" ? 0 : 1;
          require(names.size() == 2 && names[time] == "time_s" && names[1 - time] == "file",
                  "a header file,time_s must come first");
        },
        [&](int, const Cells& row) {
          series.meshes.push_back(mesh_of(series, row[1 - time], row[time]));
          require(series.meshes.size() <= kMostListed, "too many meshes, must be at most {}", kMostListed);
        });
    require(!series.meshes.empty(), "{}: no mesh in it, must hold at least one", series.times);
    return series.meshes.front().file;
  });
  mesh.file = read.value_or("");
  return read.has_value();
}

}  // namespace touchfield::schema
