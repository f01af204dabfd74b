#include "sim/field/metrics.h"

namespace touchfield {

const std::vector<MetricField>& metric_fields() {
  static const std::vector<MetricField> fields = {
      {"relative_error", "1", &Metrics::relative_error, true},
      {"relative_error_raw", "1", &Metrics::relative_error_raw, true},
      {"scale", "1", &Metrics::scale},
      {"correlation", "1", &Metrics::correlation},
      {"leakage", "1", &Metrics::leakage, true},
      {"mean_inside_pa", "Pa", &Metrics::mean_inside_pa},
      {"reached_share", "1", &Metrics::reached_share, true},
      {"cv_inside", "1", &Metrics::cv_inside, true},
      {"width_mm", "mm", &Metrics::width_mm},
      {"width_wanted_mm", "mm", &Metrics::width_wanted_mm},
      {"peak_pa", "Pa", &Metrics::peak_pa},
      {"force_target_n", "N", &Metrics::force_target_n},
      {"force_elsewhere_n", "N", &Metrics::force_elsewhere_n},
      {"cost", "Pa2", &Metrics::cost},
      {"cost_skin", "Pa2 m2", &Metrics::cost_skin},
      {"cost_bound", "Pa2 m2", &Metrics::cost_bound},
      {"optimality_gap", "1", &Metrics::optimality_gap, true},
      {"error_bound", "1", &Metrics::error_bound, true},
      {"power_share", "1", &Metrics::power_share, true},
      {"iterations", "1", &Metrics::iterations},
      {"seconds_solve", "s", &Metrics::seconds_solve},
      {"seconds_total", "s", &Metrics::seconds_total},
      {"evaluation_difference", "1", &Metrics::evaluation_difference, true},
      {"evaluation_difference_target", "1", &Metrics::evaluation_difference_target, true},
  };
  return fields;
}

}  // namespace touchfield
