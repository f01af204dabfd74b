#pragma once

#include <nlohmann/json.hpp>

#include "sim/store/run_data.h"

namespace touchfield {

/// The value, or null if it is not finite, which JSON cannot say.
nlohmann::ordered_json number_or_null(double value);

/// A run's methods with every metric, as --json prints them; what was not computed is null.
nlohmann::ordered_json methods_json(const Run& run);

}  // namespace touchfield
