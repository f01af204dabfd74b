#pragma once

#include <string>
#include <vector>

#include "sim/core/types.h"

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
