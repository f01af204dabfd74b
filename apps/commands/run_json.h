#pragma once

#include <nlohmann/json.hpp>

#include "sim/output/run_data.h"

namespace touchfield {

/// A run's methods with every metric, as --json prints them; what was not computed is null.
nlohmann::ordered_json methods_json(const Run& run);

}  // namespace touchfield
