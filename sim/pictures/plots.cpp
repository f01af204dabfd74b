#include "sim/pictures/plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include <fmt/format.h>

#include "sim/core/files.h"
#include "sim/pictures/picture_parts.h"

namespace touchfield {

namespace {

constexpr PixelBox kPlot = {120, 140, 760, 650};  // of all panels
constexpr double kLegend = kPlot.x + kPlot.width + 40.0;
constexpr double kLegendRoom = kPictureWidth - kLegend - 36.0;  // of its texts
constexpr int kHeading = 34;                                    // room above a panel
constexpr int kMostTicks = 8;

/// A regular polygon, its first corner at an angle.
struct Marker {
  int corners;
  double angle;  // [deg], counter-clockwise from the right
  Colour colour;
};

// The colours of Okabe and Ito, which people with colour-blindness tell apart, each with a shape of its own.
constexpr std::array<Marker, 6> kMarkers = {{{24, 0.0, {213, 94, 0}},
                                             {4, 45.0, {230, 159, 0}},
                                             {3, 90.0, {0, 158, 115}},
                                             {4, 0.0, {86, 180, 233}},
                                             {3, -90.0, {0, 70, 140}},
                                             {6, 0.0, {204, 121, 167}}}};

std::vector<Eigen::Vector2d> corners(const Marker& marker, const Eigen::Vector2d& centre, double growth) {
  constexpr double kRadius = 8.0;  // [pixels]
  // Shapes of one area, so that none looks more important; an outline is equally wide on every side.
  const double turn = 2.0 * std::numbers::pi / marker.corners;
  const double area = 0.5 * marker.corners * std::sin(turn);
  const double radius = kRadius * std::sqrt(std::numbers::pi / area) + growth / std::cos(0.5 * turn);
  std::vector<Eigen::Vector2d> result;
  for (int i = 0; i < marker.corners; ++i) {
    const double angle = marker.angle * std::numbers::pi / 180.0 + i * turn;
    result.emplace_back(centre.x() + radius * std::cos(angle), centre.y() + radius * std::sin(angle));
  }
  return result;
}

/// The seventh and later are outlined: shapes and colours repeat.
void draw_marker(Canvas& canvas, std::size_t number, const Eigen::Vector2d& centre) {
  const Marker& marker = kMarkers[number % kMarkers.size()];
  const bool outlined = number >= kMarkers.size();
  canvas.polygon(corners(marker, centre, outlined ? 2.0 : 1.0), outlined ? kInk : kPaper);
  canvas.polygon(corners(marker, centre, 0.0), marker.colour);
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
  std::vector<Eigen::Vector2d> marked;
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
    if (i % stride == number * stride / lines) {
      marked.push_back(piece.back());
    }
    if (point.high > point.low) {
      canvas.line(area.at(point.x, point.low), area.at(point.x, point.high), line_colour(number), 3.0);
    }
  }
  end_piece();
  for (const Eigen::Vector2d& place : marked) {
    if (line.is_marked) {
      draw_marker(canvas, number, place);
    }
  }
}

void draw_legend(Canvas& canvas, const std::string& heading, const std::vector<PlotLine>& lines) {
  double y = kPlot.y + kPlot.height - kHeading - 10.0;
  if (!heading.empty()) {
    draw_fitted(canvas, kLegend - 10.0, y, heading, {.size = 16, .bold = true}, kLegendRoom + 36.0);
    y -= 34.0;
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].is_joined) {
      canvas.line({kLegend - 16.0, y}, {kLegend + 16.0, y}, line_colour(i), 2.0);
    }
    if (lines[i].is_marked) {
      draw_marker(canvas, i, {kLegend, y});
    }
    draw_fitted(canvas, kLegend + 26.0, y, lines[i].label, {.size = 18}, kLegendRoom);
    draw_fitted(canvas, kLegend + 26.0, y - 21.0, lines[i].note, {.size = 14}, kLegendRoom);
    y -= lines[i].note.empty() ? 34.0 : 56.0;
  }
}

/// All values of the lines of panels of a label, or those of x of all panels; those that are numbers.
std::vector<double> values_of(const Plot& plot, const std::string* label) {
  std::vector<double> values;
  for (const PlotPanel& panel : plot.panels) {
    for (const PlotLine& line : panel.lines) {
      for (const PlotPoint& point : line.points) {
        if (label == nullptr) {
          values.push_back(point.x);
        } else if (panel.label == *label) {
          values.insert(values.end(), {point.low, point.high});
        }
      }
    }
  }
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  // An axis begins at zero where that wastes less than half of the height: a difference then looks as large as it is.
  if (label != nullptr && !values.empty()) {
    const auto [least, most] = std::ranges::minmax(values);
    values.push_back(least > 0.0 && least < 0.5 * most ? 0.0 : least);
  }
  return values;
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

void draw_plot(const std::string& path, const Plot& plot) {
  Canvas canvas(kPictureWidth, kPictureHeight);
  if (plot.provenance) {
    describe(canvas, *plot.provenance);
  }
  const auto count = static_cast<int>(plot.panels.size());
  const bool headed = std::ranges::any_of(plot.panels, [](const PlotPanel& panel) { return !panel.heading.empty(); });
  const PanelGrid grid = filled_grid(kPlot, count, std::min(plot.columns, count), headed ? kHeading : 14);
  const LinearAxis x(values_of(plot, nullptr), kMostTicks / grid.columns);
  for (int p = 0; p < count; ++p) {
    const PlotPanel& panel = plot.panels[static_cast<std::size_t>(p)];
    const PixelBox box = grid.panel(p);
    const bool first = p % grid.columns == 0;
    const LinearAxis y(values_of(plot, &panel.label), std::max(3, kMostTicks * box.height / kPlot.height));
    const PlotArea area{box, x, y};
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
  draw_fitted(canvas, kPlot.x + 0.5 * kPlot.width, kPlot.y - 52.0, plot.x, {.size = 20, .align = Align::kCentre},
              kPlot.width);
  if (count > 0) {
    draw_legend(canvas, plot.legend, plot.panels.front().lines);
  }
  draw_texts(canvas, plot.texts);
  write_atomically(path, {canvas.file()});
}

}  // namespace touchfield
