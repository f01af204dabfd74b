#include "apps/commands/run_json.h"

#include <cmath>

namespace touchfield {

nlohmann::ordered_json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json methods_json(const Run& run) {
  nlohmann::ordered_json methods = nlohmann::ordered_json::array();
  for (const MethodResult& method : run.methods) {
    nlohmann::ordered_json entry = {{"name", method.name}, {"method", method.method}, {"scheme", method.scheme}};
    for (const MetricField& field : metric_fields()) {
      entry[field.name] = number_or_null(method.metrics.*field.value);
    }
    entry["shock_distance_share"] = number_or_null(method.shock_distance_share);
    entry["status"] = to_string(method.solution.status);
    methods.push_back(std::move(entry));
  }
  return methods;
}

}  // namespace touchfield
