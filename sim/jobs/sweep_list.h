#pragma once

#include <optional>

#include "sim/core/json.h"
#include "sim/jobs/sweep.h"

namespace touchfield {

/// What every case of a sweep would be and take, in order; or the first one of each body, of so many bodies. Models are
/// built one by one.
///
/// returns   an array of objects: case, name, inputs, sharing (cases with the same body), seconds (of the case alone),
///           memory_mib, faces, channels, solver, warnings, notes and reason (why it cannot be built;
///           numbers are then null)
Json list_cases(const SweepInput& input, std::optional<std::size_t> bodies = std::nullopt);

}  // namespace touchfield
