#include "sim/pictures/plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/files.h"
#include "sim/core/renamed.h"
#include "sim/core/require.h"

namespace touchfield {

namespace {

constexpr int kHeading = 34;  // room above a panel
constexpr int kMostTicks = 8;

/// A regular polygon. All have one area, so that none looks more important.
struct Marker {
  int corners;
  double angle;   // of the first [deg], counter-clockwise from the right
  double radius;  // [pixels]
  Colour colour;
};

// The colours of Okabe and Ito, which people with colour-blindness tell apart, each with a shape of its own.
constexpr std::array<Marker, 6> kMarkers = {{{24, 0.0, 8.0, {213, 94, 0}},
                                             {4, 45.0, 10.0, {230, 159, 0}},
                                             {3, 90.0, 12.4, {0, 158, 115}},
                                             {4, 0.0, 10.0, {86, 180, 233}},
                                             {3, -90.0, 12.4, {0, 70, 140}},
                                             {6, 0.0, 8.8, {204, 121, 167}}}};

/// The seventh and later are outlined: shapes and colours repeat.
void draw_marker(Canvas& canvas, std::size_t number, const Eigen::Vector2d& centre) {
  const Marker& marker = kMarkers[number % kMarkers.size()];
  const bool outlined = number >= kMarkers.size();
  const double turn = 2.0 * std::numbers::pi / marker.corners;
  for (const double growth : {outlined ? 2.0 : 1.0, 0.0}) {  // on every side [pixels]
    std::vector<Eigen::Vector2d> corners;
    for (int i = 0; i < marker.corners; ++i) {
      const double angle = marker.angle * std::numbers::pi / 180.0 + i * turn;
      corners.push_back(centre + (marker.radius + growth / std::cos(0.5 * turn)) *
                                     Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
    canvas.polygon(corners, growth == 0.0 ? marker.colour : outlined ? kInk : kPaper);
  }
}

/// An axis whose ends are ticks.
class LinearAxis {
 public:
  /// Holds values in at most `pieces` steps and what rounding to ticks adds. What differs by rounding alone is one
  /// value, with room around it.
  LinearAxis(const std::vector<double>& values, int pieces) {
    auto [least, most] = values.empty() ? std::ranges::minmax({0.0, 1.0}) : std::ranges::minmax(values);
    if (!(most - least > 1e-9 * std::max(std::abs(least), std::abs(most)))) {  // or ticks would be finer than numbers
      const double room = std::max(std::abs(least), 1.0) * 0.1;
      least -= room;
      most += room;
    }
    const double step = tick_step(most - least, pieces);
    for (double i = std::floor(least / step + 1e-9); i <= std::ceil(most / step - 1e-9); ++i) {
      ticks_.push_back(i * step + 0.0);
    }
  }

  const std::vector<double>& ticks() const { return ticks_; }
  /// Where a value is in a panel's side [pixels].
  double pixel(double value, int start, int length) const {
    return start + length * (value - ticks_.front()) / (ticks_.back() - ticks_.front());
  }

 private:
  std::vector<double> ticks_;
};

/// A panel with its axes.
struct PlotArea {
  PixelBox box;
  LinearAxis x;
  LinearAxis y;

  Eigen::Vector2d at(double x_value, double y_value) const {
    return {x.pixel(x_value, box.x, box.width), y.pixel(y_value, box.y, box.height)};
  }
};

/// Frame and ticks; numbers at those of x where the panel is the lowest, of y where it is the first of its row.
void draw_frame(Canvas& canvas, const PlotArea& area, bool first, bool lowest) {
  constexpr Colour kTicks = {225, 225, 225};
  const PixelBox& box = area.box;
  for (const double tick : area.x.ticks()) {
    const double at = area.x.pixel(tick, box.x, box.width);
    canvas.line({at, box.y}, {at, box.y + box.height}, kTicks, 1.0);
    if (lowest) {
      canvas.text(at, box.y - 22.0, fmt::format("{:.6g}", tick), {.size = 16, .align = Align::kCentre});
    }
  }
  for (const double tick : area.y.ticks()) {
    const double at = area.y.pixel(tick, box.y, box.height);
    canvas.line({box.x, at}, {box.x + box.width, at}, kTicks, 1.0);
    if (first) {
      canvas.text(box.x - 12.0, at, fmt::format("{:.6g}", tick), {.size = 16, .align = Align::kRight});
    }
  }
  canvas.frame(box, kInk, 1.0);
}

/// One line; the markers of many points stand between those of the other lines.
void draw_line(Canvas& canvas, const PlotArea& area, const PlotLine& line, std::size_t number, std::size_t lines) {
  constexpr std::size_t kAllMarked = 25;  // points
  constexpr std::size_t kMarkers = 10;
  const std::size_t count = line.points.size();
  const std::size_t stride = count > kAllMarked && line.is_joined ? count / kMarkers : 1;
  std::vector<Eigen::Vector2d> piece;
  const auto end_piece = [&] {
    if (line.is_joined) {
      canvas.path(piece, line_colour(number), 2.0);
    }
    piece.clear();
  };
  for (std::size_t i = 0; i < count; ++i) {
    const PlotPoint& point = line.points[i];
    if (!std::isfinite(point.y)) {
      end_piece();
      continue;
    }
    piece.push_back(area.at(point.x, point.y));
    if (point.high > point.low) {
      canvas.line(area.at(point.x, point.low), area.at(point.x, point.high), line_colour(number), 3.0);
    }
  }
  end_piece();
  for (std::size_t i = number * stride / lines; line.is_marked && i < count; i += stride) {
    if (std::isfinite(line.points[i].y)) {
      draw_marker(canvas, number, area.at(line.points[i].x, line.points[i].y));
    }
  }
}

/// At the right of a plot's panels.
void draw_legend(Canvas& canvas, const PixelBox& room, const std::string& heading, const std::vector<PlotLine>& lines) {
  const double left = room.x + room.width + 40.0;
  const double most = kPictureWidth - left - 36.0;  // of its texts
  double y = room.y + room.height - kHeading - 10.0;
  if (!heading.empty()) {
    draw_fitted(canvas, left - 10.0, y, heading, {.size = 16, .bold = true}, most + 36.0);
    y -= 34.0;
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].is_joined) {
      canvas.line({left - 16.0, y}, {left + 16.0, y}, line_colour(i), 2.0);
    }
    if (lines[i].is_marked) {
      draw_marker(canvas, i, {left, y});
    }
    draw_fitted(canvas, left + 26.0, y, lines[i].label, {.size = 18}, most);
    draw_fitted(canvas, left + 26.0, y - 21.0, lines[i].note, {.size = 14}, most);
    y -= lines[i].note.empty() ? 34.0 : 56.0;
  }
}

/// An axis of values. It begins at zero where that wastes less than half of the height: a difference then looks as
/// large as it is.
LinearAxis height_axis(std::vector<double> values, int pieces) {
  const double least = values.empty() ? 0.0 : std::ranges::min(values);
  if (least > 0.0 && least < 0.5 * std::ranges::max(values)) {
    values.push_back(0.0);
  }
  return {values, pieces};
}

}  // namespace

Colour line_colour(std::size_t number) { return kMarkers[number % kMarkers.size()].colour; }

std::vector<PlotLine> lines_through(const std::vector<LineValue>& values) {
  std::vector<PlotLine> lines;
  std::map<std::string, std::map<double, std::vector<double>>> places;
  for (const LineValue& value : values) {
    if (!places.contains(value.line)) {
      lines.push_back({value.line, {}});
    }
    auto& own = places[value.line];
    if (std::isfinite(value.y)) {
      own[value.x].push_back(value.y);
    }
  }
  for (PlotLine& line : lines) {
    for (const auto& [x, at] : places[line.label]) {
      const auto [low, high] = std::ranges::minmax(at);
      const double mean = std::accumulate(at.begin(), at.end(), 0.0) / static_cast<double>(at.size());
      line.points.push_back({x, mean, low, high, static_cast<int>(at.size())});
    }
  }
  return lines;
}

void draw_panels(Canvas& canvas, const Plot& plot, const PixelBox& room) {
  const auto count = static_cast<int>(plot.panels.size());
  const bool headed = std::ranges::any_of(plot.panels, [](const PlotPanel& panel) { return !panel.heading.empty(); });
  const PanelGrid grid = filled_grid(room, count, std::min(plot.columns, count), headed ? kHeading : 14);
  std::vector<double> all_x;
  std::map<std::string, std::vector<double>> all_y;  // of panels with a label
  for (const PlotPanel& panel : plot.panels) {
    for (const PlotLine& line : panel.lines) {
      for (const PlotPoint& point : line.points) {
        all_x.push_back(point.x);
        if (std::isfinite(point.y)) {
          all_y[panel.label].insert(all_y[panel.label].end(), {point.low, point.high});
        }
      }
    }
  }
  const LinearAxis x(all_x, kMostTicks / grid.columns);
  for (int p = 0; p < count; ++p) {
    const PlotPanel& panel = plot.panels[static_cast<std::size_t>(p)];
    PixelBox box = grid.panel(p);
    box.width -= grid.columns > 1 ? 30 : 0;  // for markers at the end
    const bool first = p % grid.columns == 0;
    const PlotArea area{box, x, height_axis(all_y[panel.label], std::max(4, box.height / 80))};
    draw_frame(canvas, area, first, p + grid.columns >= count);
    for (std::size_t i = 0; i < panel.lines.size(); ++i) {
      draw_line(canvas, area, panel.lines[i], i, panel.lines.size());
    }
    draw_fitted(canvas, box.x + 0.5 * box.width, box.y + box.height + 0.5 * kHeading, panel.heading,
                {.size = 18, .align = Align::kCentre, .bold = true}, box.width);
    if (first) {
      draw_fitted(canvas, 36.0, box.y + 0.5 * box.height, panel.label,
                  {.size = 18, .align = Align::kCentre, .angle = 90.0}, box.height + grid.above);
    }
  }
  draw_fitted(canvas, room.x + 0.5 * room.width, room.y - 52.0, plot.x, {.size = 20, .align = Align::kCentre},
              room.width);
  if (count > 0) {
    draw_legend(canvas, room, plot.legend, plot.panels.front().lines);
  }
}

void draw_plot(const std::string& path, const Plot& plot) {
  constexpr PixelBox kPlot = {120, 140, 760, 650};  // of all panels
  Canvas canvas(kPictureWidth, kPictureHeight);
  if (plot.provenance) {
    describe(canvas, *plot.provenance);
  }
  draw_panels(canvas, plot, kPlot);
  draw_texts(canvas, plot.texts);
  write_atomically(path, {canvas.file()});
}

namespace {

constexpr std::size_t kMostSeries = 12;  // that shapes, colours and outlines tell apart

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

std::size_t count_of(const Parameter& parameter) {
  return std::set<std::string>(parameter.texts.begin(), parameter.texts.end()).size();
}

std::vector<Parameter> varying(const SweepSummary& summary, const std::vector<SweepRow>& rows) {
  std::vector<Parameter> found;
  for (const std::string& path : summary.parameters) {
    Parameter parameter{path, {}, {}};
    for (const SweepRow& row : rows) {
      parameter.texts.push_back(input_of(*row.record, path).value_or("as in the scene"));
    }
    if (count_of(parameter) < 2) {
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

std::string paths_of(const std::vector<Parameter>& parameters) {
  std::vector<std::string> paths;
  for (const Parameter& parameter : parameters) {
    paths.push_back(parameter.path);
  }
  return fmt::format("{}", fmt::join(paths, ", "));
}

/// Without series one panel with a line for each method, else a panel for each method with a line for each series.
std::vector<PlotPanel> panels_of(const std::vector<SweepRow>& rows, const PlotPlan& plan, const MetricField& field) {
  const bool apart = !plan.series.empty();
  const std::string unit = field.unit;
  std::vector<PlotPanel> panels;
  for (const SweepRow& first : rows) {
    const std::string name = apart && first.method != nullptr ? first.method->name : "";
    if (first.method == nullptr || std::ranges::find(panels, name, &PlotPanel::heading) != panels.end()) {
      continue;
    }
    std::vector<LineValue> values;
    for (std::size_t row = 0; row < rows.size(); ++row) {
      if (const SweepRecord::Method* method = rows[row].method; method != nullptr) {
        values.push_back({apart ? series_of(plan, row) : method->name, plan.axis->numbers[row],
                          apart && method->name != name ? kNotComputed : method->metrics.*field.value});
      }
    }
    panels.push_back({unit == "1" ? std::string(field.name) : fmt::format("{} [{}]", field.name, unit),
                      lines_through(values), name});
  }
  return panels;
}

/// What the plot does not show by its axes and legend.
std::string caption_of(const SweepSummary& summary, const PlotPlan& plan, int averaged) {
  std::vector<std::string> sentences;
  if (const auto failed = std::ranges::count(summary.records, "failed", &SweepRecord::status); failed > 0) {
    sentences.push_back(fmt::format("Failed cases are left out: {}.", failed));
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

std::string draw_sweep(const std::string& path, const SweepSummary& summary, const std::string& metric) {
  const MetricField& field = field_of(metric);
  const std::vector<SweepRow> rows = sweep_rows(summary);
  const PlotPlan plan = plan_of(varying(summary, rows));
  if (!plan.axis) {
    return "no input is a number in every case, and differs";
  }
  std::vector<PlotPanel> panels = panels_of(rows, plan, field);
  const std::size_t lines = panels.empty() ? 0 : panels.front().lines.size();
  if (!plan.series.empty() && lines > kMostSeries) {
    return fmt::format("{} combinations of {} are more than the {} that a plot can show; sweep.csv has them", lines,
                       paths_of(plan.series), kMostSeries);
  }
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
    return fmt::format("no case has a {}", metric);
  }
  draw_plot(path, {.texts = {.title = summary.name,
                             .subtitle = fmt::format("{} of {} cases", summary.records.size(), summary.cases),
                             .caption = caption_of(summary, plan, averaged),
                             .foot = "Values are in the units of the scene's keys."},
                   .x = plan.axis->path,
                   .panels = panels,
                   .columns = 2,
                   .legend = paths_of(plan.series)});
  return "";
}

}  // namespace touchfield
