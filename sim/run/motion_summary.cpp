#include "sim/run/motion_summary.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sim/run/motion_stages.h"

namespace touchfield {

namespace {

Worst worst_of(double Metrics::*metric) {
  const bool more_is_better = metric == &Metrics::correlation || metric == &Metrics::mean_inside_pa ||
                              metric == &Metrics::reached_share || metric == &Metrics::force_target_n;
  return more_is_better ? Worst::kSmallest : Worst::kLargest;
}

}  // namespace

double percentile(std::vector<double> values, double share) {
  if (values.empty()) {
    return kNotComputed;
  }
  const double place = share * static_cast<double>(values.size() - 1);
  const auto low = values.begin() + static_cast<std::ptrdiff_t>(std::floor(place));
  std::nth_element(values.begin(), low, values.end());
  const double part = place - std::floor(place);
  return part > 0 ? *low + part * (*std::min_element(low + 1, values.end()) - *low) : *low;
}

Statistics statistics(std::vector<double> values, Worst worst) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) {
    return {};
  }
  const auto [least, most] = std::ranges::minmax(values);
  return {.count = static_cast<int>(values.size()),
          .mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size()),
          .median = percentile(values, 0.5),
          .p95 = percentile(values, 0.95),
          .worst = worst == Worst::kLargest ? most : least};
}

MotionSummary summary(const MotionMethod& method) {
  MotionSummary result;
  result.frames = static_cast<int>(method.frames.size());
  result.dropped = method.dropped;
  result.scores = static_cast<int>(method.scores.size());
  std::vector<double> latencies;
  std::vector<double> seconds;
  for (const MotionFrame& frame : method.frames) {
    result.silent += frame.silent ? 1 : 0;
    result.lost += frame.lost ? 1 : 0;
    result.late += frame.late > 0 ? 1 : 0;
    latencies.push_back(frame.shown - frame.sampled);
    if (!frame.silent) {
      seconds.push_back(total_seconds(frame));
    }
  }
  result.latency = statistics(std::move(latencies));
  result.frame_seconds = statistics(std::move(seconds));
  const auto over_scores = [&](const auto& value, Worst worst = Worst::kLargest) {
    std::vector<double> values;
    std::ranges::transform(method.scores, std::back_inserter(values), value);
    return statistics(std::move(values), worst);
  };
  result.displacement = over_scores(shown_displacement);
  result.age = over_scores(&MotionScore::age);
  for (const MetricField& field : metric_fields()) {
    result.metrics.push_back(over_scores(
        [value = field.value](const MotionScore& score) { return score.metrics.*value; }, worst_of(field.value)));
  }
  return result;
}

const Statistics& statistics_of(const MotionSummary& summary, double Metrics::*metric) {
  const auto place = std::ranges::find(metric_fields(), metric, &MetricField::value) - metric_fields().begin();
  return summary.metrics.at(static_cast<std::size_t>(place));
}

std::vector<std::pair<std::string, double>> summary_columns(const MotionSummary& summary) {
  std::vector<std::pair<std::string, double>> columns;
  const auto add = [&](const std::string& name, const Statistics& values) {
    columns.emplace_back(name + "_mean", values.mean);
    columns.emplace_back(name + "_median", values.median);
    columns.emplace_back(name + "_p95", values.p95);
    columns.emplace_back(name + "_worst", values.worst);
    columns.emplace_back(name + "_count", values.count);
  };
  for (std::size_t i = 0; i < metric_fields().size(); ++i) {
    add(metric_fields()[i].name, summary.metrics.at(i));
  }
  add("displacement_m", summary.displacement);
  add("age_s", summary.age);
  add("latency_s", summary.latency);
  add("frame_seconds", summary.frame_seconds);
  columns.emplace_back("frames", summary.frames);
  columns.emplace_back("silent", summary.silent);
  columns.emplace_back("lost", summary.lost);
  columns.emplace_back("late", summary.late);
  columns.emplace_back("dropped", summary.dropped);
  columns.emplace_back("scores", summary.scores);
  return columns;
}

}  // namespace touchfield
