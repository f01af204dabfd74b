#pragma once

#include <nlohmann/json.hpp>

#include "sim/store/run_compare.h"

namespace touchfield {

/// How two runs differ, as --json prints it. What is infinitely far apart is null; `fault` says why.
nlohmann::ordered_json difference_json(const RunDifference& difference);

}  // namespace touchfield
