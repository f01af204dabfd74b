#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

/// The names of release 0.3 that have changed. A user who gives an old one gets an error with the new one.
namespace touchfield {

enum class NameOf {
  kKey,       // of a scene or of results: a metric, a column, a field of JSON
  kPython,    // in the package, or of a class: Run.judge
  kArgument,  // of a function of the package
};

struct Renamed {
  NameOf kind;
  std::string_view old;
  std::string_view now;
};

inline constexpr std::array kRenamed = {
    Renamed{NameOf::kKey, "judge", "evaluation"},
    Renamed{NameOf::kKey, "certificate", "optimality_bound"},
    Renamed{NameOf::kKey, "alarm", "resonance_check"},
    Renamed{NameOf::kKey, "spread", "tolerances"},
    Renamed{NameOf::kKey, "quiet_weight", "outside_weight"},  // before the next row, which it begins with
    Renamed{NameOf::kKey, "quiet", "silent"},
    Renamed{NameOf::kKey, "port", "listen"},
    Renamed{NameOf::kPython, "judge", "evaluate"},
    Renamed{NameOf::kPython, "certify", "optimality_bound"},
    Renamed{NameOf::kPython, "Run.judge", "evaluation"},
    Renamed{NameOf::kPython, "Problem.quiet", "outside"},
    Renamed{NameOf::kArgument, "quiet", "outside"},
};

/// The new name of an old one; empty if it has not changed. Names that begin with a row and an underscore have changed
/// with it: judge_difference, Run.judge_mesh.
inline std::string new_name(NameOf kind, std::string_view old) {
  for (const Renamed& renamed : kRenamed) {
    const std::string_view rest = old.substr(std::min(renamed.old.size(), old.size()));
    if (renamed.kind == kind && old.starts_with(renamed.old) && (rest.empty() || rest.front() == '_')) {
      return std::string(renamed.now).append(rest);
    }
  }
  return {};
}

}  // namespace touchfield
