#pragma once

#include <optional>
#include <string>

#include "apps/commands/command_line.h"

namespace touchfield {

struct CompareCommand {
  std::string a;  // run.h5, or the directory that holds one
  std::string b;
  std::optional<double> tolerance;  // relative
};

/// Prints how two runs differ.
///
/// returns   1 if a tolerance is given and a phase [rad], an amplitude, a pressure, a metric or a field differs by
/// more,
///           or is in one run alone; else 0
/// throws    InputError if a file cannot be read, damaged ones included: 1 says that runs differ
int compare_command(const CompareCommand& command, const CommonFlags& flags);

}  // namespace touchfield
