#include "sim/pictures/sweep_picture.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/atomic_file.h"
#include "sim/core/errors.h"
#include "sim/pictures/canvas.h"
#include "sim/pictures/linear_axis.h"
#include "sim/pictures/picture_parts.h"

namespace touchfield {

namespace {

constexpr PixelBox kLines = {120, 160, 760, 600};  // of all their panels
constexpr PixelBox kMaps = {110, 150, 900, 620};
constexpr int kGap = 80;  // between panels
constexpr double kLegend = kLines.x + kLines.width + 40.0;
constexpr double kLegendRoom = kPictureWidth - kLegend - 36.0;  // of its texts
constexpr double kLegendLine = 34.0;
constexpr int kTickSize = 16;
constexpr int kMostTicks = 8;
constexpr std::size_t kMostSeries = 12;  // that shapes, colours and outlines tell apart
constexpr std::size_t kMostMaps = 8;
constexpr std::size_t kLongestLabel = 44;  // letters
constexpr double kFilled = 0.5;            // share of a map's cells that have a case, at least

const MetricField& field_of(const std::string& metric) {
  const auto& fields = metric_fields();
  const auto found = std::ranges::find_if(fields, [&](const MetricField& field) { return metric == field.name; });
  if (found == fields.end()) {
    throw InputError(fmt::format("metric {}: unknown; metrics.csv names them", metric));
  }
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

/// Whether a number that goes with another rises or falls with it all the way.
bool monotone(const Parameter& along, const Parameter& other) {
  std::map<double, double> values;
  for (std::size_t i = 0; i < along.numbers.size(); ++i) {
    values[along.numbers[i]] = other.numbers[i];
  }
  std::vector<double> in_order;
  for (const auto& [x, value] : values) {
    in_order.push_back(value);
  }
  return std::ranges::is_sorted(in_order) || std::ranges::is_sorted(in_order, std::greater<>{});
}

/// What a sweep's plot shows of its inputs.
struct PlotPlan {
  std::vector<Parameter> axes;     // one: lines against it; two: maps
  std::vector<Parameter> series;   // one line, or map, for each combination of their values
  std::vector<Parameter> along;    // go with the first axis
  std::vector<Parameter> average;  // over which values are averaged
  bool joined = true;              // whether points along the axis are joined by lines
};

/// Distinct combinations of values, each with the row where it is first.
std::map<std::vector<std::string>, std::size_t> combinations(const std::vector<Parameter>& parameters,
                                                             std::size_t rows) {
  std::map<std::vector<std::string>, std::size_t> found;
  for (std::size_t row = 0; row < rows; ++row) {
    std::vector<std::string> values;
    for (const Parameter& parameter : parameters) {
      values.push_back(parameter.texts[row]);
    }
    found.emplace(std::move(values), row);
  }
  return found;
}

/// Two numbers make a map if most pairs of their values have a case, and there are few maps.
bool make_maps(const std::vector<Parameter>& numbers, const std::vector<Parameter>& series, std::size_t methods,
               std::size_t rows) {
  const std::size_t maps = methods * combinations(series, rows).size();
  return numbers.size() == 2 && maps <= kMostMaps &&
         static_cast<double>(combinations(numbers, rows).size()) >=
             kFilled * static_cast<double>(count_of(numbers[0]) * count_of(numbers[1]));
}

PlotPlan plan_of(const std::vector<Parameter>& parameters, std::size_t methods, std::size_t rows) {
  PlotPlan plan;
  std::vector<Parameter> numbers;
  const bool has_axis = std::ranges::any_of(
      parameters, [](const Parameter& parameter) { return !parameter.numbers.empty() && !parameter.is_seed(); });
  for (const Parameter& parameter : parameters) {
    const auto together = [&](const Parameter& other) { return go_together(parameter, other); };
    if (parameter.is_seed() && !parameter.numbers.empty() && has_axis) {
      plan.average.push_back(parameter);
    } else if (std::ranges::any_of(numbers, together)) {
      plan.along.push_back(parameter);
    } else {
      (parameter.numbers.empty() ? plan.series : numbers).push_back(parameter);
    }
  }
  std::erase_if(plan.series, [&](const Parameter& text) {
    const bool along = std::ranges::any_of(numbers, [&](const Parameter& other) { return go_together(text, other); });
    if (along) {
      plan.along.push_back(text);
    }
    return along;
  });
  if (make_maps(numbers, plan.series, methods, rows)) {
    plan.axes = std::move(numbers);
    return plan;
  }
  if (const auto axis = std::ranges::max_element(numbers, {}, count_of); axis != numbers.end()) {
    plan.axes.push_back(*axis);
    numbers.erase(axis);
    plan.series.insert(plan.series.end(), numbers.begin(), numbers.end());
    plan.joined = std::ranges::all_of(
        plan.along, [&](const Parameter& other) { return other.numbers.empty() || monotone(plan.axes[0], other); });
  }
  return plan;
}

/// A value of the metric, with the inputs that it belongs to.
struct Sample {
  std::string method;
  std::size_t series;
  double x;
  double y;  // the second axis; 0 if there is none
  double value;
  double low;  // of the cases that it is the mean of
  double high;
  int cases;
};

/// One sample for each method, series and place: the mean of the cases that share them.
std::vector<Sample> samples_of(const std::vector<SweepRow>& rows, const PlotPlan& plan,
                               const std::vector<std::size_t>& series, double Metrics::*metric) {
  std::map<std::tuple<std::string, std::size_t, double, double>, std::vector<double>> values;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const SweepRecord::Method* method = rows[row].method;
    if (method == nullptr || !std::isfinite(method->metrics.*metric)) {
      continue;
    }
    const double y = plan.axes.size() > 1 ? plan.axes[1].numbers[row] : 0.0;
    values[{method->name, series[row], plan.axes[0].numbers[row], y}].push_back(method->metrics.*metric);
  }
  std::vector<Sample> samples;
  for (const auto& [key, of] : values) {
    const auto& [method, number, x, y] = key;
    const auto [low, high] = std::ranges::minmax(of);
    const double mean = std::accumulate(of.begin(), of.end(), 0.0) / static_cast<double>(of.size());
    samples.push_back({method, number, x, y, of.size() > 1 ? mean : of[0], low, high, static_cast<int>(of.size())});
  }
  return samples;
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
      draw_line(canvas, own, x, y, line, plan.joined);
    }
  }
  draw_fitted(canvas, kLines.x + 0.5 * kLines.width, kLines.y - 52.0, plan.axes[0].path,
              {.size = 20, .align = Align::kCentre}, kLines.width);
  draw_fitted(canvas, 36.0, kLines.y + 0.5 * kLines.height, label, {.size = 20, .align = Align::kCentre, .angle = 90.0},
              kLines.height);
  draw_legend(canvas, apart ? paths_of(plan.series) : "", apart ? series.labels : methods);
}

/// Cells between the middles of neighbouring values.
std::vector<double> cell_ends(const std::set<double>& values) {
  const std::vector<double> at(values.begin(), values.end());
  if (at.size() == 1) {
    return {at.front() - 0.5, at.front() + 0.5};
  }
  std::vector<double> ends;
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    ends.push_back(0.5 * (at[i] + at[i + 1]));
  }
  ends.insert(ends.begin(), at.front() - (ends.front() - at.front()));
  ends.push_back(at.back() + (at.back() - ends.back()));
  return ends;
}

void draw_bar(Canvas& canvas, double low, double high, const std::string& label) {
  constexpr PixelBox kBar = {1060, 200, 26, 520};
  canvas.image(kBar, [&](int /*i*/, int j) { return viridis(static_cast<double>(j) / (kBar.height - 1)); });
  canvas.frame(kBar, kInk, 1.0);
  constexpr int kPieces = 4;
  for (int i = 0; i <= kPieces; ++i) {
    const double share = static_cast<double>(i) / kPieces;
    canvas.text(kBar.x + kBar.width + 10.0, kBar.y + share * kBar.height,
                fmt::format("{:.3g}", low + share * (high - low)), {.size = kTickSize});
  }
  canvas.text(kBar.x - 22.0, kBar.y + 0.5 * kBar.height, label, {.size = 18, .align = Align::kCentre, .angle = 90.0});
}

/// A map of the values at pairs of xs and ys, with its axes.
void draw_map(Canvas& canvas, const PixelBox& panel, const std::map<std::pair<double, double>, double>& values,
              const std::set<double>& xs, const std::set<double>& ys, const std::pair<double, double>& range) {
  const std::vector<double> x_ends = cell_ends(xs);
  const std::vector<double> y_ends = cell_ends(ys);
  const auto value_at = [](const std::set<double>& at, const std::vector<double>& ends, double share) {
    const double place = ends.front() + share * (ends.back() - ends.front());
    const auto cell = std::upper_bound(ends.begin() + 1, ends.end() - 1, place) - (ends.begin() + 1);
    return *std::next(at.begin(), cell);
  };
  const auto [least, most] = range;
  canvas.image(panel, [&, least = least, most = most](int i, int j) {
    const double x = value_at(xs, x_ends, (i + 0.5) / panel.width);
    const double y = value_at(ys, y_ends, (j + 0.5) / panel.height);
    const auto found = values.find({x, y});
    return found == values.end() ? kNoValue : viridis(most > least ? (found->second - least) / (most - least) : 0.5);
  });
  canvas.frame(panel, kInk, 1.0);
  const LinearAxis x(*xs.begin(), *xs.rbegin(), 0, 1, kMostTicks);
  const LinearAxis y(*ys.begin(), *ys.rbegin(), 0, 1, kMostTicks);
  const auto place = [](double value, const std::vector<double>& ends) {
    return (value - ends.front()) / (ends.back() - ends.front());
  };
  for (int i = 0; i < x.tick_count(); ++i) {
    const double share = place(x.tick(i), x_ends);
    if (share >= 0 && share <= 1) {
      canvas.text(panel.x + share * panel.width, panel.y - 18.0, x.label(i), {.size = 14, .align = Align::kCentre});
    }
  }
  for (int i = 0; i < y.tick_count(); ++i) {
    const double share = place(y.tick(i), y_ends);
    if (share >= 0 && share <= 1) {
      canvas.text(panel.x - 10.0, panel.y + share * panel.height, y.label(i), {.size = 14, .align = Align::kRight});
    }
  }
}

/// A map for each method and series, one colour scale for all.
void draw_maps(Canvas& canvas, const std::vector<Sample>& samples, const std::vector<std::string>& methods,
               const PlotPlan& plan, const Series& series, const std::string& label) {
  std::set<double> xs;
  std::set<double> ys;
  for (const Sample& sample : samples) {
    xs.insert(sample.x);
    ys.insert(sample.y);
  }
  const auto range = range_of(samples, &Sample::value, &Sample::value);
  const std::size_t count = series.labels.size();
  const std::vector<PixelBox> panels = panels_in(kMaps, methods.size() * count);
  for (std::size_t p = 0; p < panels.size(); ++p) {
    std::map<std::pair<double, double>, double> values;
    for (const Sample& sample : samples) {
      if (sample.method == methods[p / count] && sample.series == p % count) {
        values[{sample.x, sample.y}] = sample.value;
      }
    }
    draw_map(canvas, panels[p], values, xs, ys, range);
    draw_heading(canvas, panels[p],
                 count > 1 ? fmt::format("{}, {}", methods[p / count], series.labels[p % count]) : methods[p]);
  }
  draw_fitted(canvas, kMaps.x + 0.5 * kMaps.width, 100.0, plan.axes[0].path, {.size = 20, .align = Align::kCentre},
              kMaps.width);
  draw_fitted(canvas, 30.0, kMaps.y + 0.5 * kMaps.height, plan.axes[1].path,
              {.size = 20, .align = Align::kCentre, .angle = 90.0}, kMaps.height);
  draw_bar(canvas, range.first, range.second, label);
}

/// What the plot does not show by its axes and legend.
std::string caption_of(const SweepSummary& summary, const PlotPlan& plan, const Series& series,
                       const std::vector<Sample>& samples) {
  std::vector<std::string> sentences;
  const auto failed = std::ranges::count(summary.records, "failed", &SweepRecord::status);
  if (failed > 0) {
    sentences.push_back(
        fmt::format("{} case{} failed and {} left out.", failed, failed == 1 ? "" : "s", failed == 1 ? "is" : "are"));
  }
  if (std::string parts = parts_text(summary); !parts.empty()) {
    sentences.push_back(std::move(parts));
  }
  const int most = std::ranges::max(samples, {}, &Sample::cases).cases;
  if (most > 1) {
    sentences.push_back(fmt::format(
        "Values are means over {}{}.", plan.average.empty() ? "cases with the same inputs" : paths_of(plan.average),
        plan.axes.size() > 1 ? fmt::format(", of {} cases at most", most) : "; bars go from the least to the largest"));
  }
  if (plan.axes.size() > 1 && series.labels.size() > 1) {
    sentences.push_back(fmt::format("Headings: {}.", paths_of(plan.series)));
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
  const PlotPlan plan = plan_of(varying(summary, rows), methods.size(), rows.size());
  if (plan.axes.empty()) {
    return {"no input is a number in every case, and differs"};
  }
  const Series series = series_of(rows, plan);
  if (plan.axes.size() == 1 && series.labels.size() > kMostSeries) {
    return {fmt::format("{} combinations of {} are more than the {} that it can tell apart; sweep.csv has them",
                        series.labels.size(), paths_of(plan.series), kMostSeries)};
  }
  const std::vector<Sample> samples = samples_of(rows, plan, series.of_row, field.value);
  if (samples.empty()) {
    return {fmt::format("no case has a {}", metric)};
  }
  Canvas canvas(kPictureWidth, kPictureHeight, format);
  const auto draw = plan.axes.size() == 1 ? draw_lines : draw_maps;
  draw(canvas, samples, methods, plan, series, label_of(field));
  draw_title(canvas, summary.name, fmt::format("{} of {} cases", summary.records.size(), summary.cases));
  draw_caption(canvas, caption_of(summary, plan, series, samples), "Values are as the scene's keys have them.");
  write_atomically(path, {canvas.file()});
  return {};
}

}  // namespace touchfield
