#pragma once

#include <optional>
#include <string>

#include "apps/commands/command_line.h"

namespace touchfield {

/// What `compare RUN --points FILE` is asked for.
struct PointsComparison {
  std::string points;   // measured points
  std::string method;   // empty: the run's first
  std::string rows;     // CSV file with a row a point; empty: none
  std::string picture;  // its ending says what it is; empty: none
  bool force = false;   // whether these files replace others
};

/// Compares a run's field with measured points and prints what comes of it.
///
/// tolerance   of the relative L2 difference
/// returns     the exit code: 1 if the difference is above the tolerance
int compare_points(const std::string& run, const PointsComparison& asked, const std::optional<double>& tolerance,
                   const CommonFlags& flags);

}  // namespace touchfield
