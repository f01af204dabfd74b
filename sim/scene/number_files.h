#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/core/types.h"
#include "sim/scene/body_spec.h"
#include "sim/scene/input.h"

/// Files of numbers that a scene names. Each reader throws InputError as number_table.h says.
namespace touchfield::schema {

/// Levels of faces, 0 to 1, separated by commas or white space; one of them is > 0. # starts a comment.
std::vector<double> read_levels(const std::string& path);

/// Phases [rad] in the same form.
std::vector<double> read_phases(const std::string& path);

/// Columns of a positions file; axes as written, not yet of unit length.
struct PositionsFile {
  Points points;                     // [m]
  std::optional<Points> axes;        // if the file has them
  std::vector<Eigen::Index> dead{};  // rows of transducers that make no sound
};

/// A table of transducers with the columns x_mm and y_mm. It may have z_mm, nx, ny, nz, channel, and alive or dead.
/// Without these columns z is 0 and axes are +z. Columns id and name are not read.
PositionsFile read_positions(const std::string& path);

/// Gains and phases of a calibration file, one value per channel.
struct CalibrationFile {
  std::vector<double> gain;
  std::vector<double> phase;  // [rad]
};

/// A table with one row per channel, in any order. Its columns are channel (from 0), gain >= 0, phase_rad or phase_deg
/// and, optionally, alive (0 or 1). The gain of a dead channel counts as 0. Every channel must be there once.
///
/// channels   of the array
CalibrationFile read_calibration(const std::string& path, std::size_t channels);

}  // namespace touchfield::schema

namespace touchfield {

/// Pressures that somebody measured in the air, e.g. with a microphone.
struct MeasuredPoints {
  Points points;              // 3 x J [m], in the world's frame
  Eigen::VectorXcd pressure;  // J, in any unit; without phases their magnitudes
  bool complex = false;       // whether there are phases
  std::vector<int> lines;     // J: of the file
};

/// A table with a header and one row per point: x_mm, y_mm, z_mm and p_pa, a magnitude, or p_re and p_im; # starts a
/// comment. A phase follows the time factor exp(-i omega t): it grows on the way from the source.
///
/// throws   InputError that names the first fault as file:line: what, rule
MeasuredPoints read_measured_points(const std::string& path);

}  // namespace touchfield

namespace touchfield::schema {

/// Reads the table of times of a series whose keys were good: a header file,time_s (in either order) and one row per
/// mesh; # starts a comment. Files count from the series' folder. Fills in its meshes, and the first as the mesh's
/// file.
///
/// in        the map that holds `folder` and `times`
/// returns   false after a report: no such folder or file, a time that is no number or not after the one before it
bool read_mesh_times(const Input& in, MeshShape& mesh);

}  // namespace touchfield::schema
