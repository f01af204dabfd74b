#include "apps/commands/run_json.h"

#include <cmath>

namespace touchfield {

nlohmann::ordered_json methods_json(const Run& run) {
  nlohmann::ordered_json methods = nlohmann::ordered_json::array();
  for (const MethodResult& method : run.methods) {
    nlohmann::ordered_json entry = {{"name", method.name}, {"method", method.method}, {"scheme", method.scheme}};
    for (const MetricField& field : metric_fields()) {
      const double value = method.metrics.*field.value;
      entry[field.name] = std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
    }
    entry["status"] = to_string(method.solution.status);
    methods.push_back(std::move(entry));
  }
  return methods;
}

}  // namespace touchfield
