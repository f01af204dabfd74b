#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/core/types.h"
#include "sim/scene/input.h"

namespace touchfield::schema {

/// Columns of a positions file; axes as written, not yet of unit length.
struct PositionsFile {
  Points points;               // [m]
  std::optional<Points> axes;  // if the file has six columns
};

/// Numbers separated by commas or white space; # starts a comment. [rad]
///
/// in      the value that names the file; problems are reported there as `file:line: what`
/// returns nothing after a report
std::optional<std::vector<double>> read_phases(const Input& in, const std::string& path);

/// Lines x_mm,y_mm,z_mm or x_mm,y_mm,z_mm,ax,ay,az, all alike; # starts a comment, and the first line may be a header.
std::optional<PositionsFile> read_positions(const Input& in, const std::string& path);

}  // namespace touchfield::schema
