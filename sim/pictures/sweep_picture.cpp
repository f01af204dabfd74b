#include "sim/pictures/sweep_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include <fmt/format.h>

#include "sim/core/atomic_file.h"
#include "sim/core/errors.h"
#include "sim/core/text_number.h"
#include "sim/pictures/canvas.h"
#include "sim/pictures/linear_axis.h"
#include "sim/pictures/picture_parts.h"

namespace touchfield {

namespace {

constexpr PixelBox kPlot = {120, 160, 760, 600};
constexpr double kLegend = kPlot.x + kPlot.width + 40.0;
constexpr double kLegendRoom = kPictureWidth - kLegend - 36.0;  // of its texts
constexpr double kLegendLine = 34.0;
constexpr int kTickSize = 16;
constexpr int kMostTicks = 8;

/// A value of the metric with the parameters it belongs to.
struct Sample {
  std::string method;
  double x;
  double y;  // the second parameter; 0 if there is none
  double value;
};

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

/// Parameters whose values are all numbers and differ.
std::vector<std::string> varying(const SweepSummary& summary, const std::vector<SweepRow>& rows) {
  std::vector<std::string> names;
  for (const std::string& parameter : summary.parameters) {
    const auto numbers = parameter_numbers(parameter, rows);
    if (numbers && std::set<double>(numbers->begin(), numbers->end()).size() > 1 &&
        std::ranges::none_of(*numbers, [](double number) { return std::isnan(number); })) {
      names.push_back(parameter);
    }
  }
  return names;
}

/// One sample a method and place: the mean of the cases that share it.
std::vector<Sample> samples_of(const std::vector<SweepRow>& rows, const std::vector<std::string>& parameters,
                               double Metrics::*metric) {
  std::map<std::tuple<std::string, double, double>, std::pair<double, int>> sums;
  for (const SweepRow& row : rows) {
    if (row.method == nullptr || !std::isfinite(row.method->metrics.*metric)) {
      continue;
    }
    std::array<double, 2> at = {0.0, 0.0};
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      at[i] = *number_of<double>(*input_of(*row.record, parameters[i]));
    }
    auto& [sum, count] = sums[{row.method->name, at[0], at[1]}];
    sum += row.method->metrics.*metric;
    ++count;
  }
  std::vector<Sample> samples;
  for (const auto& [key, mean] : sums) {
    samples.push_back({std::get<0>(key), std::get<1>(key), std::get<2>(key), mean.first / mean.second});
  }
  return samples;
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

std::pair<double, double> range_of(const std::vector<Sample>& samples, double Sample::*value) {
  const auto [low, high] = std::ranges::minmax(samples, {}, value);
  return {low.*value, high.*value};
}

void draw_lines(Canvas& canvas, const std::vector<Sample>& samples, const std::vector<std::string>& methods,
                const std::string& parameter, const std::string& label) {
  const auto [first, last] = range_of(samples, &Sample::x);
  const auto [least, most] = range_of(samples, &Sample::value);
  const LinearAxis x(first, last, kPlot.x, kPlot.width, kMostTicks);
  const LinearAxis y(axis_begin(least, most), most, kPlot.y, kPlot.height, kMostTicks);
  draw_plot(canvas, kPlot, x, y);
  draw_fitted(canvas, kPlot.x + 0.5 * kPlot.width, kPlot.y - 52.0, parameter, {.size = 20, .align = Align::kCentre},
              kPlot.width);
  draw_fitted(canvas, 36.0, kPlot.y + 0.5 * kPlot.height, label, {.size = 20, .align = Align::kCentre, .angle = 90.0},
              kPlot.height);
  for (std::size_t m = 0; m < methods.size(); ++m) {
    std::vector<Eigen::Vector2d> places;
    for (const Sample& sample : samples) {  // ascending in x
      if (sample.method == methods[m]) {
        places.emplace_back(x.pixel(sample.x), y.pixel(sample.value));
      }
    }
    canvas.path(places, marker_colour(m), 2.0);
    for (const Eigen::Vector2d& place : places) {
      draw_marker(canvas, m, place, false);
    }
    const double at = kPlot.y + kPlot.height - 20.0 - static_cast<double>(m) * kLegendLine;
    draw_marker(canvas, m, {kLegend, at}, false);
    draw_fitted(canvas, kLegend + 26.0, at, methods[m], {.size = 18}, kLegendRoom);
  }
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

void draw_maps(Canvas& canvas, const std::vector<Sample>& samples, const std::vector<std::string>& methods,
               const std::vector<std::string>& parameters, const std::string& label) {
  std::set<double> xs;
  std::set<double> ys;
  for (const Sample& sample : samples) {
    xs.insert(sample.x);
    ys.insert(sample.y);
  }
  const std::vector<double> x_ends = cell_ends(xs);
  const std::vector<double> y_ends = cell_ends(ys);
  const auto [least, most] = range_of(samples, &Sample::value);
  const int columns = methods.size() > 1 ? 2 : 1;
  const int rows = static_cast<int>((methods.size() + 1) / 2);
  constexpr int kLeft = 110;
  constexpr int kBottom = 150;
  constexpr int kGap = 80;
  const int width = (900 - kGap * (columns - 1)) / columns;
  const int height = (620 - kGap * (rows - 1)) / rows;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const int column = static_cast<int>(m) % columns;
    const int row = static_cast<int>(m) / columns;
    const PixelBox panel = {kLeft + column * (width + kGap), kBottom + (rows - 1 - row) * (height + kGap), width,
                            height};
    std::map<std::pair<double, double>, double> values;
    for (const Sample& sample : samples) {
      if (sample.method == methods[m]) {
        values[{sample.x, sample.y}] = sample.value;
      }
    }
    const auto value_at = [](const std::set<double>& at, const std::vector<double>& ends, double share) {
      const double place = ends.front() + share * (ends.back() - ends.front());
      const auto cell = std::upper_bound(ends.begin() + 1, ends.end() - 1, place) - (ends.begin() + 1);
      return *std::next(at.begin(), cell);
    };
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
    draw_fitted(canvas, panel.x + 0.5 * panel.width, panel.y + panel.height + 16.0, methods[m],
                {.size = 18, .align = Align::kCentre, .bold = true}, panel.width);
  }
  draw_fitted(canvas, kLeft + 450.0, 100.0, parameters[0], {.size = 20, .align = Align::kCentre}, 900.0);
  draw_fitted(canvas, 30.0, kBottom + 310.0, parameters[1], {.size = 20, .align = Align::kCentre, .angle = 90.0},
              620.0);
  draw_bar(canvas, least, most, label);
}

}  // namespace

void require_metric(const std::string& name) { field_of(name); }

bool draw_sweep(const std::string& path, const SweepSummary& summary, const std::string& metric, PictureFormat format) {
  const MetricField& field = field_of(metric);
  const std::vector<SweepRow> rows = sweep_rows(summary);
  const std::vector<std::string> parameters = varying(summary, rows);
  if (parameters.empty() || parameters.size() > 2) {
    return false;
  }
  const std::vector<Sample> samples = samples_of(rows, parameters, field.value);
  if (samples.empty()) {
    return false;
  }
  Canvas canvas(kPictureWidth, kPictureHeight, format);
  const std::vector<std::string> methods = methods_of(rows);
  if (parameters.size() == 1) {
    draw_lines(canvas, samples, methods, parameters.front(), label_of(field));
  } else {
    draw_maps(canvas, samples, methods, parameters, label_of(field));
  }
  draw_title(canvas, summary.name, fmt::format("{} of {} cases", summary.records.size(), summary.cases));
  const auto failed = std::ranges::count(summary.records, "failed", &SweepRecord::status);
  draw_caption(canvas, failed > 0 ? fmt::format("{} cases failed and are left out.", failed) : "",
               "Values are as the scene's keys have them.");
  write_atomically(path, {canvas.file()});
  return true;
}

}  // namespace touchfield
