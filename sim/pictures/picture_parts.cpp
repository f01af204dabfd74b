#include "sim/pictures/picture_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/format.h>

#include "sim/model/warnings.h"

namespace touchfield {

namespace {

constexpr int kLeft = 30;  // [pixels]
constexpr double kTextWidth = kPictureWidth - 2.0 * kLeft;

/// 10^floor(log10 value), and how many times it is in value (1 <= share < 10).
struct Decade {
  double unit;
  double share;
};

Decade decade(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)));
  return {unit, value / unit};
}

constexpr double kRadius = 8.0;  // of a marker [pixels]

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

}  // namespace

double round_above(double value) {
  if (!(value > 0) || !std::isfinite(value)) {
    return 1.0;
  }
  const auto [unit, share] = decade(value);
  constexpr double kSlack = 1e-9;  // 3000.0000001 is 3000
  for (const double step : {1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0}) {
    if (share <= step * (1.0 + kSlack)) {
      return step * unit;
    }
  }
  return 10.0 * unit;
}

double tick_step(double range, int most) {
  const auto [unit, share] = decade(range / most);
  for (const double step : {1.0, 2.0, 5.0}) {
    if (share <= step) {
      return step * unit;
    }
  }
  return 10.0 * unit;
}

std::vector<double> even_ticks(double low, double high, int most) {
  const double step = tick_step(high - low, most);
  constexpr double kRounding = 1e-9;
  std::vector<double> ticks;
  for (double i = std::ceil(low / step - kRounding); i * step <= high + kRounding * step; ++i) {
    ticks.push_back(i * step + 0.0);
  }
  return ticks;
}

double quantile(std::vector<double> values, double share) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) {
    return 0.0;
  }
  const auto last = static_cast<double>(values.size() - 1);
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(std::ceil(share * last));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

double skin_top(double most_wanted, const std::vector<const Eigen::VectorXcd*>& pressures) {
  double top = 0.0;
  for (const Eigen::VectorXcd* pressure : pressures) {
    top = std::max(top, quantile(magnitudes(*pressure), kTopShare));
  }
  return skin_top(most_wanted, top);
}

double skin_top(double most_wanted, double most) {
  return round_above(most_wanted > 0 ? std::clamp(most, most_wanted, 2.0 * most_wanted) : most);
}

std::vector<double> magnitudes(const Eigen::VectorXcd& pressure) {
  std::vector<double> values;
  std::ranges::transform(pressure, std::back_inserter(values), [](const Complex& p) { return std::abs(p); });
  return values;
}

void describe(Canvas& canvas, const Provenance& provenance) {
  canvas.describe("Software", "touchfield " + provenance.version);
  canvas.describe("Source", provenance.revision);
  canvas.describe("Scene hash", provenance.scene_hash);
}

void draw_fitted(Canvas& canvas, double x, double y, const std::string& text, TextStyle style, double most) {
  const double width = canvas.text_width(text, style);
  style.size *= std::min(1.0, most / std::max(width, 1.0));
  canvas.text(x, y, text, style);
}

std::string picture_title(const std::string& name, const std::vector<std::string>& notes) {
  const bool alone = std::ranges::any_of(notes, [](const std::string& note) { return note.starts_with(kHandAlone); });
  return alone ? name + ", hand alone" : name;
}

void draw_title(Canvas& canvas, const std::string& title, const std::string& subtitle) {
  canvas.describe("Description", title);
  draw_fitted(canvas, kLeft, kPictureHeight - 34, title, {.size = 26, .bold = true}, kTextWidth);
  draw_fitted(canvas, kLeft, kPictureHeight - 68, subtitle, {.size = 20}, kTextWidth);
}

void draw_caption(Canvas& canvas, const std::string& first, const std::string& second) {
  draw_fitted(canvas, kLeft, 56, first, {.size = 20}, kTextWidth);
  draw_fitted(canvas, kLeft, 24, second, {.size = 15}, kTextWidth);
}

void draw_colour_bar(Canvas& canvas, const ColourBar& bar) {
  constexpr double kPoint = 22.0;  // [pixels]
  const PixelBox& box = bar.box;
  const double middle = box.x + 0.5 * box.width;
  const double upper = box.y + box.height;
  const int right = box.x + box.width;
  const double from = bar.has_suction ? bar.bottom / bar.top : 0.0;
  canvas.image(box, [&](int, int j) { return bar.map(from + (1.0 - from) * (j + 0.5) / box.height); });
  canvas.frame(box, kInk, 1.0);
  const bool clipped = bar.most > bar.top;
  if (clipped) {
    canvas.polygon({{box.x, upper + 3}, {right, upper + 3}, {middle, upper + 3 + kPoint}}, bar.map(1.0));
    draw_fitted(canvas, right + 10, upper + 3 + 0.5 * kPoint, fmt::format("to {:.3g}", bar.most), {.size = 16},
                kPictureWidth - right - 16);
  }
  canvas.text(middle, upper + (clipped ? kPoint : 0.0) + 24, bar.label, {.size = 18, .align = Align::kCentre});
  for (const double tick : even_ticks(bar.bottom, bar.top, std::clamp(box.height / 60, 2, 8))) {
    const double y = box.y + box.height * ((tick - bar.bottom) / (bar.top - bar.bottom));
    canvas.line({right, y}, {right + 6, y}, kInk, 1.0);
    draw_fitted(canvas, right + 10, y, fmt::format("{:.6g}", tick), {.size = 16}, kPictureWidth - right - 16);
  }
}

ColourBar skin_bar(const SkinScale& scale, double most) {
  return {.label = scale.label,
          .bottom = scale.bottom / scale.unit,
          .top = scale.top / scale.unit,
          .map = skin_colour,
          .most = most / scale.unit,
          .has_suction = scale.bottom < 0.0};
}

std::vector<Colour> skin_colours(const Eigen::VectorXd& values, double top) {
  std::vector<Colour> colours;
  std::ranges::transform(values, std::back_inserter(colours), [&](double value) { return skin_colour(value / top); });
  return colours;
}

void draw_sight(Canvas& canvas, const SkinSight& sight, const std::vector<Colour>& colours, const PixelBox& panel) {
  canvas.image(panel, sight.image(colours, canvas.format() == PictureFormat::kPng ? 1 : 2));
}

void draw_sight(Canvas& canvas, const SkinSight& sight, const ColourAt& colour_at, const PixelBox& panel) {
  canvas.image(panel, sight.image(colour_at, canvas.format() == PictureFormat::kPng ? 1 : 2));
}

void draw_scale_bar(Canvas& canvas, const PixelBox& panel, double metres_per_pixel) {
  const double length = tick_step(0.3 * panel.width * metres_per_pixel, 2);
  const double right = panel.x + length / metres_per_pixel;
  const double y = panel.y - 14.0;
  canvas.line({panel.x, y}, {right, y}, kInk, 3.0);
  canvas.text(right + 10.0, y, fmt::format("{:.6g} mm", 1e3 * length), {.size = 15});
}

void draw_marker(Canvas& canvas, std::size_t number, const Eigen::Vector2d& centre, bool outlined) {
  const Marker& marker = kMarkers[number % kMarkers.size()];
  canvas.polygon(corners(marker, centre, outlined ? 2.0 : 1.0), outlined ? kInk : kPaper);
  canvas.polygon(corners(marker, centre, 0.0), marker.colour);
}

Colour marker_colour(std::size_t number) { return kMarkers[number % kMarkers.size()].colour; }

LinearAxis::LinearAxis(double least, double most, double start_pixel, double pixels, int pieces)
    : start(start_pixel), length(pixels) {
  if (!(most - least > 1e-9 * std::max(std::abs(least), std::abs(most)))) {  // or ticks would be finer than numbers are
    const double room = std::max(std::abs(least), 1.0) * 0.1;
    least -= room;
    most += room;
  }
  step = tick_step(most - least, pieces);
  low = std::floor(least / step + 1e-9) * step;
  high = std::ceil(most / step - 1e-9) * step;
}

int LinearAxis::tick_count() const { return static_cast<int>(std::lround((high - low) / step)) + 1; }

std::string LinearAxis::label(int i) const {
  return fmt::format("{:.6g}", std::round(tick(i) / step) * step == 0.0 ? 0.0 : tick(i));
}

void draw_plot(Canvas& canvas, const PixelBox& plot, const LinearAxis& x, const LinearAxis& y, bool labelled) {
  constexpr Colour kTicks = {225, 225, 225};
  constexpr double kLabelSize = 16;
  for (int i = 0; i < x.tick_count(); ++i) {
    const double at = x.pixel(x.tick(i));
    canvas.line({at, plot.y}, {at, plot.y + plot.height}, kTicks, 1.0);
    if (labelled) {
      canvas.text(at, plot.y - 22.0, x.label(i), {.size = kLabelSize, .align = Align::kCentre});
    }
  }
  for (int i = 0; i < y.tick_count(); ++i) {
    const double at = y.pixel(y.tick(i));
    canvas.line({plot.x, at}, {plot.x + plot.width, at}, kTicks, 1.0);
    canvas.text(plot.x - 14.0, at, y.label(i), {.size = kLabelSize, .align = Align::kRight});
  }
  canvas.frame(plot, kInk, 1.0);
}

}  // namespace touchfield
