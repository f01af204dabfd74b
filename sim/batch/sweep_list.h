#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/batch/sweep.h"
#include "sim/core/json.h"
#include "sim/solve/warnings.h"

namespace touchfield {

/// What a case would be and take, without computing it.
struct ListedCase {
  SweepCase item;
  std::string name;  // of its scene
  int sharing = 1;   // cases of the sweep that share its body
  CaseCost cost{};   // zeros if it cannot be built
  std::string solver{};
  std::string judged_skin{};
  Remarks remarks{};
  std::string reason{};  // why it cannot be built; else empty
};

/// Every case of a sweep, in order; or the first one of each body, of so many bodies. Models are built one by one.
std::vector<ListedCase> list_cases(const SweepInput& input, std::optional<std::size_t> bodies = std::nullopt);

/// Case, name, inputs, sharing, seconds, memory_mib, faces, channels, solver, judged_skin, warnings, notes and reason;
/// numbers of a case that cannot be built are null.
Json case_value(const ListedCase& listed);

}  // namespace touchfield
