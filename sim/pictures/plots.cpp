#include "sim/pictures/plots.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/files.h"
#include "sim/core/renamed.h"
#include "sim/core/require.h"
#include "sim/pictures/canvas.h"
#include "sim/pictures/picture_parts.h"

namespace touchfield {

namespace {

constexpr PixelBox kLines = {120, 160, 760, 600};  // of all their panels
constexpr int kGap = 80;                           // between panels
constexpr double kLegend = kLines.x + kLines.width + 40.0;
constexpr double kLegendRoom = kPictureWidth - kLegend - 36.0;  // of its texts
constexpr double kLegendLine = 34.0;
constexpr int kMostTicks = 8;
constexpr std::size_t kMostSeries = 12;    // that shapes, colours and outlines tell apart
constexpr std::size_t kLongestLabel = 44;  // letters

const MetricField& field_of(const std::string& metric) {
  const auto& fields = metric_fields();
  const auto find = [&](const std::string& name) { return std::ranges::find(fields, name, &MetricField::name); };
  const std::string now = new_name(NameOf::kKey, metric);
  require(find(now) == fields.end(), "metric {}: this metric is called {}", metric, now);
  const auto found = find(metric);
  require(found != fields.end(), "metric {}: unknown; metrics.csv names them", metric);
  return *found;
}

std::string label_of(const MetricField& field) {
  const std::string unit = field.unit;
  return unit == "1" ? std::string(field.name) : fmt::format("{} [{}]", field.name, unit);
}

/// An input that differs between the cases of a sweep.
struct Parameter {
  std::string path;
  std::vector<std::string> texts;  // a value per row, as written; of a case that leaves it alone what the scene has
  std::vector<double> numbers;     // the same; empty if one of them is no number

  bool is_seed() const { return path == "seed" || path.ends_with(".seed"); }
};

constexpr const char* kUnchanged = "as in the scene";

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

/// A value of the metric, with the inputs that it belongs to.
struct Sample {
  std::string method;
  std::size_t series;
  double x;
  double value;
  double low;  // of the cases that it is the mean of
  double high;
  int cases;
};

/// What samples are made of: values by method, series and place.
using Values = std::map<std::tuple<std::string, std::size_t, double>, std::vector<double>>;

/// One sample for each method, series and place: the mean of the cases that share them.
std::vector<Sample> means_of(const Values& values) {
  std::vector<Sample> samples;
  for (const auto& [key, of] : values) {
    const auto& [method, number, x] = key;
    const auto [low, high] = std::ranges::minmax(of);
    const double mean = std::accumulate(of.begin(), of.end(), 0.0) / static_cast<double>(of.size());
    samples.push_back({method, number, x, of.size() > 1 ? mean : of[0], low, high, static_cast<int>(of.size())});
  }
  return samples;
}

std::vector<Sample> samples_of(const std::vector<SweepRow>& rows, const PlotPlan& plan,
                               const std::vector<std::size_t>& series, double Metrics::*metric) {
  Values values;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const SweepRecord::Method* method = rows[row].method;
    if (method != nullptr && std::isfinite(method->metrics.*metric)) {
      values[{method->name, series[row], plan.axis->numbers[row]}].push_back(method->metrics.*metric);
    }
  }
  return means_of(values);
}

/// Series by their numbers: of each row, and how the legend calls them.
struct Series {
  std::vector<std::size_t> of_row;
  std::vector<std::string> labels;
};

std::string shortened(const std::string& label) {
  const std::size_t half = kLongestLabel / 2;
  return label.size() <= kLongestLabel ? label : label.substr(0, half) + ".." + label.substr(label.size() - half + 2);
}

Series series_of(const std::vector<SweepRow>& rows, const PlotPlan& plan) {
  Series series;
  std::map<std::vector<std::string>, std::size_t> numbers;
  std::set<std::string> taken;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    std::vector<std::string> values;
    for (const Parameter& parameter : plan.series) {
      values.push_back(parameter.texts[row]);
    }
    const auto [found, fresh] = numbers.emplace(values, numbers.size());
    if (fresh) {
      std::string label = shortened(fmt::format("{}", fmt::join(values, ", ")));
      if (!taken.insert(label).second) {
        label = fmt::format("case {}: {}", rows[row].record->number, label);
      }
      series.labels.push_back(label);
    }
    series.of_row.push_back(found->second);
  }
  return series;
}

/// Methods in the order of the table.
std::vector<std::string> methods_of(const std::vector<SweepRow>& rows) {
  std::vector<std::string> methods;
  for (const SweepRow& row : rows) {
    if (row.method != nullptr && std::ranges::find(methods, row.method->name) == methods.end()) {
      methods.push_back(row.method->name);
    }
  }
  return methods;
}

std::pair<double, double> range_of(const std::vector<Sample>& samples, double Sample::*low, double Sample::*high) {
  return {std::ranges::min(samples, {}, low).*low, std::ranges::max(samples, {}, high).*high};
}

/// Boxes of equal size in two columns, from the upper left one.
std::vector<PixelBox> panels_in(const PixelBox& area, std::size_t count) {
  const int columns = count > 1 ? 2 : 1;
  const int rows = static_cast<int>((count + 1) / 2);
  const int width = (area.width - kGap * (columns - 1)) / columns;
  const int height = (area.height - kGap * (rows - 1)) / rows;
  std::vector<PixelBox> panels;
  for (int i = 0; i < static_cast<int>(count); ++i) {
    panels.push_back(
        {area.x + i % columns * (width + kGap), area.y + (rows - 1 - i / columns) * (height + kGap), width, height});
  }
  return panels;
}

void draw_heading(Canvas& canvas, const PixelBox& panel, const std::string& text) {
  draw_fitted(canvas, panel.x + 0.5 * panel.width, panel.y + panel.height + 16.0, text,
              {.size = 18, .align = Align::kCentre, .bold = true}, panel.width);
}

/// Later ones are outlined: markers repeat.
void draw_series_marker(Canvas& canvas, std::size_t number, const Eigen::Vector2d& centre) {
  draw_marker(canvas, number, centre, number >= kMostSeries / 2);
}

/// One line, with what its points are means of.
void draw_line(Canvas& canvas, const std::vector<Sample>& samples, const LinearAxis& x, const LinearAxis& y,
               std::size_t number, bool joined) {
  std::vector<Eigen::Vector2d> places;
  for (const Sample& sample : samples) {  // ascending in x
    places.emplace_back(x.pixel(sample.x), y.pixel(sample.value));
    if (sample.high > sample.low) {
      canvas.line({x.pixel(sample.x), y.pixel(sample.low)}, {x.pixel(sample.x), y.pixel(sample.high)},
                  marker_colour(number), 3.0);
    }
  }
  if (joined) {
    canvas.path(places, marker_colour(number), 2.0);
  }
  for (const Eigen::Vector2d& place : places) {
    draw_series_marker(canvas, number, place);
  }
}

void draw_legend(Canvas& canvas, const std::string& heading, const std::vector<std::string>& labels) {
  const double top = kLines.y + kLines.height - 20.0;
  if (!heading.empty()) {
    draw_fitted(canvas, kLegend - 10.0, top, heading, {.size = 16, .bold = true}, kLegendRoom + 36.0);
  }
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const double at = top - static_cast<double>(i + (heading.empty() ? 0 : 1)) * kLegendLine;
    draw_series_marker(canvas, i, {kLegend, at});
    draw_fitted(canvas, kLegend + 26.0, at, labels[i], {.size = 18}, kLegendRoom);
  }
}

std::string paths_of(const std::vector<Parameter>& parameters) {
  std::vector<std::string> paths;
  for (const Parameter& parameter : parameters) {
    paths.push_back(parameter.path);
  }
  return fmt::format("{}", fmt::join(paths, ", "));
}

/// Without series a line for each method, else a panel for each method and a line for each series.
void draw_lines(Canvas& canvas, const std::vector<Sample>& samples, const std::vector<std::string>& methods,
                const PlotPlan& plan, const Series& series, const std::string& label) {
  const auto [first, last] = range_of(samples, &Sample::x, &Sample::x);
  const auto [least, most] = range_of(samples, &Sample::low, &Sample::high);
  const bool apart = series.labels.size() > 1;
  const std::vector<PixelBox> panels = panels_in(kLines, apart ? methods.size() : 1);
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const PixelBox& panel = panels[p];
    const int ticks = std::max(2, kMostTicks * panel.height / kLines.height);
    const LinearAxis x(first, last, panel.x, panel.width, panels.size() > 1 ? kMostTicks / 2 : kMostTicks);
    const LinearAxis y(axis_begin(least, most), most, panel.y, panel.height, ticks);
    draw_plot(canvas, panel, x, y);
    if (apart) {
      draw_heading(canvas, panel, methods[p]);
    }
    for (std::size_t line = 0; line < (apart ? series.labels.size() : methods.size()); ++line) {
      std::vector<Sample> own;
      std::ranges::copy_if(samples, std::back_inserter(own), [&](const Sample& sample) {
        return apart ? sample.method == methods[p] && sample.series == line : sample.method == methods[line];
      });
      draw_line(canvas, own, x, y, line, plan.along.empty());
    }
  }
  draw_fitted(canvas, kLines.x + 0.5 * kLines.width, kLines.y - 52.0, plan.axis->path,
              {.size = 20, .align = Align::kCentre}, kLines.width);
  draw_fitted(canvas, 36.0, kLines.y + 0.5 * kLines.height, label, {.size = 20, .align = Align::kCentre, .angle = 90.0},
              kLines.height);
  draw_legend(canvas, apart ? paths_of(plan.series) : "", apart ? series.labels : methods);
}

/// What the plot does not show by its axes and legend.
std::string caption_of(const SweepSummary& summary, const PlotPlan& plan, const std::vector<Sample>& samples) {
  std::vector<std::string> sentences;
  const auto failed = std::ranges::count(summary.records, "failed", &SweepRecord::status);
  if (failed > 0) {
    sentences.push_back(
        fmt::format("{} case{} failed and {} left out.", failed, failed == 1 ? "" : "s", failed == 1 ? "is" : "are"));
  }
  const int most = std::ranges::max(samples, {}, &Sample::cases).cases;
  if (most > 1) {
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

SweepPlot draw_sweep(const std::string& path, const SweepSummary& summary, const std::string& metric,
                     PictureFormat format) {
  const MetricField& field = field_of(metric);
  const std::vector<SweepRow> rows = sweep_rows(summary);
  const std::vector<std::string> methods = methods_of(rows);
  const PlotPlan plan = plan_of(varying(summary, rows));
  if (!plan.axis) {
    return {"no input is a number in every case, and differs"};
  }
  const Series series = series_of(rows, plan);
  if (series.labels.size() > kMostSeries) {
    return {fmt::format("{} combinations of {} are more than the {} that a plot can show; sweep.csv has them",
                        series.labels.size(), paths_of(plan.series), kMostSeries)};
  }
  const std::vector<Sample> samples = samples_of(rows, plan, series.of_row, field.value);
  if (samples.empty()) {
    return {fmt::format("no case has a {}", metric)};
  }
  Canvas canvas(kPictureWidth, kPictureHeight, format);
  draw_lines(canvas, samples, methods, plan, series, label_of(field));
  draw_title(canvas, summary.name, fmt::format("{} of {} cases", summary.records.size(), summary.cases));
  draw_caption(canvas, caption_of(summary, plan, samples), "Values are in the units of the scene's keys.");
  write_atomically(path, {canvas.file()});
  return {};
}

void draw_points(const std::string& path, const PlotTexts& texts, const std::vector<PlotPoint>& points,
                 PictureFormat format) {
  Values values;
  std::vector<std::string> lines;
  for (const PlotPoint& point : points) {
    values[{point.line, 0, point.x}].push_back(point.y);
    if (std::ranges::find(lines, point.line) == lines.end()) {
      lines.push_back(point.line);
    }
  }
  PlotPlan plan;
  plan.axis = Parameter{texts.x, {}, {}};
  Canvas canvas(kPictureWidth, kPictureHeight, format);
  if (!points.empty()) {
    draw_lines(canvas, means_of(values), lines, plan, {}, texts.y);
  }
  draw_title(canvas, texts.title, points.empty() ? "nothing to show" : "");
  write_atomically(path, {canvas.file()});
}

void draw_scan(const std::string& path, const ScanPicture& picture, const Eigen::VectorXd& computed,
               const Eigen::VectorXd& measured, PictureFormat format) {
  constexpr PixelBox kScan = {280, 160, 640, 640};
  constexpr int kMostPieces = 6;
  const double top = round_above(std::max(computed.maxCoeff(), measured.maxCoeff()));
  const LinearAxis x(0.0, top, kScan.x, kScan.width, kMostPieces);
  const LinearAxis y(0.0, top, kScan.y, kScan.height, kMostPieces);
  Canvas canvas(kPictureWidth, kPictureHeight, format);
  draw_plot(canvas, kScan, x, y);
  canvas.line({x.start, y.start}, {x.start + x.length, y.start + y.length}, kInk, 1.5);
  for (Eigen::Index j = 0; j < computed.size(); ++j) {
    draw_marker(canvas, 0, {x.pixel(computed(j)), y.pixel(measured(j))}, false);
  }
  canvas.text(kScan.x + 0.5 * kScan.width, kScan.y - 52.0, "computed, scaled", {.size = 20, .align = Align::kCentre});
  canvas.text(kScan.x - 110.0, kScan.y + 0.5 * kScan.height, "measured, as in the file",
              {.size = 20, .align = Align::kCentre, .angle = 90.0});
  draw_title(canvas, picture.title, "measured against computed pressure");
  draw_caption(canvas, picture.first, picture.second);
  write_atomically(path, {canvas.file()});
}

}  // namespace touchfield
