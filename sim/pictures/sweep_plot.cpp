#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/renamed.h"
#include "sim/core/require.h"
#include "sim/pictures/plots.h"

namespace touchfield {

namespace {

constexpr std::size_t kMostSeries = 12;  // that shapes, colours and outlines tell apart
constexpr const char* kUnchanged = "as in the scene";

const MetricField& field_of(const std::string& metric) {
  const auto& fields = metric_fields();
  const auto find = [&](const std::string& name) { return std::ranges::find(fields, name, &MetricField::name); };
  const std::string now = new_name(NameOf::kKey, metric);
  require(find(now) == fields.end(), "metric {}: this metric is called {}", metric, now);
  const auto found = find(metric);
  require(found != fields.end(), "metric {}: unknown; metrics.csv names them", metric);
  return *found;
}

/// An input that differs between the cases of a sweep.
struct Parameter {
  std::string path;
  std::vector<std::string> texts;  // a value per row, as written; of a case that leaves it alone what the scene has
  std::vector<double> numbers;     // the same; empty if one of them is no number

  bool is_seed() const { return path == "seed" || path.ends_with(".seed"); }
};

std::vector<Parameter> varying(const SweepSummary& summary, const std::vector<SweepRow>& rows) {
  std::vector<Parameter> found;
  for (const std::string& path : summary.parameters) {
    Parameter parameter{path, {}, {}};
    for (const SweepRow& row : rows) {
      parameter.texts.push_back(input_of(*row.record, path).value_or(kUnchanged));
    }
    if (std::set<std::string>(parameter.texts.begin(), parameter.texts.end()).size() < 2) {
      continue;
    }
    const auto numbers = parameter_numbers(path, rows);
    if (numbers && std::ranges::none_of(*numbers, [](double number) { return std::isnan(number); })) {
      parameter.numbers = *numbers;
    }
    found.push_back(std::move(parameter));
  }
  return found;
}

std::size_t count_of(const Parameter& parameter) {
  return std::set<std::string>(parameter.texts.begin(), parameter.texts.end()).size();
}

/// Whether each value of one comes with one of the other alone, as in a zip or in random draws.
bool go_together(const Parameter& a, const Parameter& b) {
  std::set<std::pair<std::string, std::string>> pairs;
  for (std::size_t i = 0; i < a.texts.size(); ++i) {
    pairs.emplace(a.texts[i], b.texts[i]);
  }
  return pairs.size() == count_of(a) && pairs.size() == count_of(b);
}

/// What a sweep's plot shows of its inputs.
struct PlotPlan {
  std::optional<Parameter> axis;
  std::vector<Parameter> series;   // one line for each combination of their values
  std::vector<Parameter> along;    // go with the axis
  std::vector<Parameter> average;  // over which values are averaged
};

/// The axis is the number with most values; a seed only if there is no other.
PlotPlan plan_of(const std::vector<Parameter>& parameters) {
  PlotPlan plan;
  const auto weight = [](const Parameter& parameter) {
    return parameter.numbers.empty() ? std::pair(0, std::size_t{0})
                                     : std::pair(parameter.is_seed() ? 1 : 2, count_of(parameter));
  };
  const auto axis = std::ranges::max_element(parameters, {}, weight);
  if (axis == parameters.end() || axis->numbers.empty()) {
    return plan;
  }
  plan.axis = *axis;
  for (const Parameter& parameter : parameters) {
    if (&parameter != &*axis) {
      const bool averaged = parameter.is_seed() && !parameter.numbers.empty() && !axis->is_seed();
      (averaged ? plan.average : go_together(parameter, *axis) ? plan.along : plan.series).push_back(parameter);
    }
  }
  return plan;
}

/// What the legend calls the line of a row.
std::string series_of(const PlotPlan& plan, std::size_t row) {
  std::vector<std::string> values;
  for (const Parameter& parameter : plan.series) {
    values.push_back(parameter.texts[row]);
  }
  return fmt::format("{}", fmt::join(values, ", "));
}

/// Each once, in the order of the table.
std::vector<std::string> distinct(const std::vector<std::string>& texts) {
  std::vector<std::string> found;
  for (const std::string& text : texts) {
    if (std::ranges::find(found, text) == found.end()) {
      found.push_back(text);
    }
  }
  return found;
}

std::string paths_of(const std::vector<Parameter>& parameters) {
  std::vector<std::string> paths;
  for (const Parameter& parameter : parameters) {
    paths.push_back(parameter.path);
  }
  return fmt::format("{}", fmt::join(paths, ", "));
}

/// Rows that have a method: its name, and the line of the series.
struct PlotNames {
  std::vector<std::string> methods;
  std::vector<std::string> series;
};

PlotNames names_of(const std::vector<SweepRow>& rows, const PlotPlan& plan) {
  PlotNames names;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (rows[row].method != nullptr) {
      names.methods.push_back(rows[row].method->name);
      names.series.push_back(series_of(plan, row));
    }
  }
  return {distinct(names.methods), distinct(names.series)};
}

/// Without series one panel with a line for each method, else a panel for each method with a line for each series.
std::vector<PlotPanel> panels_of(const std::vector<SweepRow>& rows, const PlotPlan& plan, const PlotNames& names,
                                 const MetricField& field) {
  const bool apart = names.series.size() > 1;
  std::vector<PlotPanel> panels;
  for (const std::string& name : apart ? names.methods : std::vector<std::string>{""}) {
    std::vector<LineValue> values;
    for (const std::string& label : apart ? names.series : names.methods) {
      values.push_back({label, 0.0, kNotComputed});  // every panel has all lines
    }
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const SweepRecord::Method* method = rows[row].method;
      if (method != nullptr && (!apart || method->name == name)) {
        values.push_back(
            {apart ? series_of(plan, row) : method->name, plan.axis->numbers[row], method->metrics.*field.value});
      }
    }
    const std::string unit = field.unit;
    panels.push_back({unit == "1" ? std::string(field.name) : fmt::format("{} [{}]", field.name, unit),
                      lines_through(values), name});
  }
  return panels;
}

/// What the plot does not show by its axes and legend.
std::string caption_of(const SweepSummary& summary, const PlotPlan& plan, int averaged) {
  std::vector<std::string> sentences;
  const auto failed = std::ranges::count(summary.records, "failed", &SweepRecord::status);
  if (failed > 0) {
    sentences.push_back(
        fmt::format("{} case{} failed and {} left out.", failed, failed == 1 ? "" : "s", failed == 1 ? "is" : "are"));
  }
  if (averaged > 1) {
    sentences.push_back(fmt::format("Values are means over {}; bars go from the least to the largest.",
                                    plan.average.empty() ? "cases with the same inputs" : paths_of(plan.average)));
  }
  if (!plan.along.empty()) {
    sentences.push_back(fmt::format("Other inputs vary too: {}.", paths_of(plan.along)));
  }
  return fmt::format("{}", fmt::join(sentences, " "));
}

}  // namespace

void require_metric(const std::string& name) { field_of(name); }

SweepPlot draw_sweep(const std::string& path, const SweepSummary& summary, const std::string& metric) {
  const MetricField& field = field_of(metric);
  const std::vector<SweepRow> rows = sweep_rows(summary);
  const PlotPlan plan = plan_of(varying(summary, rows));
  if (!plan.axis) {
    return {"no input is a number in every case, and differs"};
  }
  const PlotNames names = names_of(rows, plan);
  if (names.series.size() > kMostSeries) {
    return {fmt::format("{} combinations of {} are more than the {} that a plot can show; sweep.csv has them",
                        names.series.size(), paths_of(plan.series), kMostSeries)};
  }
  std::vector<PlotPanel> panels = panels_of(rows, plan, names, field);
  int averaged = 0;
  for (PlotPanel& panel : panels) {
    for (PlotLine& line : panel.lines) {
      line.is_joined = plan.along.empty();
      for (const PlotPoint& point : line.points) {
        averaged = std::max(averaged, point.count);
      }
    }
  }
  if (averaged == 0) {
    return {fmt::format("no case has a {}", metric)};
  }
  draw_plot(path, {.texts = {.title = summary.name,
                             .subtitle = fmt::format("{} of {} cases", summary.records.size(), summary.cases),
                             .caption = caption_of(summary, plan, averaged),
                             .foot = "Values are in the units of the scene's keys."},
                   .x = plan.axis->path,
                   .panels = panels,
                   .columns = 2,
                   .legend = paths_of(plan.series)});
  return {};
}

}  // namespace touchfield
