#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/core/types.h"
#include "sim/scene/input.h"

namespace touchfield::schema {

/// Levels of faces, 0 to 1, in the same form; one of them is > 0.
std::optional<std::vector<double>> read_levels(const Input& in, const std::string& path);
inline constexpr std::size_t kMostLevelBytes = std::size_t{64} << 20U;  // of five million faces, 12 bytes each

/// Columns of a positions file; axes as written, not yet of unit length.
struct PositionsFile {
  Points points;                     // [m]
  std::optional<Points> axes;        // if the file has them
  std::vector<Eigen::Index> dead{};  // rows of transducers that make no sound
};

/// Numbers separated by commas or white space; # starts a comment. [rad]
///
/// in      the value that names the file; problems are reported there as `file:line: what`
/// returns nothing after a report
std::optional<std::vector<double>> read_phases(const Input& in, const std::string& path);

/// Gains and phases of a calibration file, one value per channel.
struct CalibrationFile {
  std::vector<double> gain;
  std::vector<double> phase;  // [rad]
};

/// A table with a header and one row per channel, in any order. Its columns are channel (from 0), gain >= 0, phase_rad
/// or phase_deg and, optionally, alive (0 or 1). The gain of a dead channel counts as 0. Every channel must be there
/// once.
///
/// channels   of the array
std::optional<CalibrationFile> read_calibration(const Input& in, const std::string& path, std::size_t channels);

/// A table of transducers (number_table.h). It has the columns x and y. It may have z, nx, ny, nz, channel, and alive
/// or dead. Lengths without a unit are in mm. Without these columns z is 0 and axes are +z. Columns that name rows (id,
/// ...) are not read. Phases and gains are refused, with the key that takes them. Without a header the columns are x,
/// y, z in mm, or these and the axes.
std::optional<PositionsFile> read_positions(const Input& in, const std::string& path);

}  // namespace touchfield::schema
