#include "apps/commands/run_json.h"

#include <cmath>

#include "sim/store/run_file.h"

namespace touchfield {

nlohmann::ordered_json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json methods_json(const Run& run) { return nlohmann::ordered_json::parse(method_values(run).json()); }

}  // namespace touchfield
