#include "sim/pictures/picture_parts.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/model/warnings.h"

namespace touchfield {

namespace {

/// The least of `steps`, ascending from 1 to 10, times a power of ten that is not below value > 0.
double rounded_up(double value, std::initializer_list<double> steps) {
  constexpr double kSlack = 1e-9;  // 3000.0000001 is 3000
  const double unit = std::pow(10.0, std::floor(std::log10(value)));
  return unit * *std::ranges::find_if(steps, [&](double step) { return value <= step * unit * (1.0 + kSlack); });
}

}  // namespace

double round_above(double value) {
  return value > 0 && std::isfinite(value) ? rounded_up(value, {1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0})
                                           : 1.0;
}

double tick_step(double range, int most) { return rounded_up(range / most, {1.0, 2.0, 5.0, 10.0}); }

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

void draw_texts(Canvas& canvas, const PictureTexts& texts) {
  constexpr int kLeft = 30;  // [pixels]
  constexpr double kMost = kPictureWidth - 2.0 * kLeft;
  canvas.describe("Description", texts.title);
  draw_fitted(canvas, kLeft, canvas.height() - 34, texts.title, {.size = 26, .bold = true}, kMost);
  draw_fitted(canvas, kLeft, canvas.height() - 68, texts.subtitle, {.size = 20}, kMost);
  draw_fitted(canvas, kLeft, 56, texts.caption, {.size = 20}, kMost);
  draw_fitted(canvas, kLeft, 24, texts.foot, {.size = 15}, kMost);
}

void draw_colour_bar(Canvas& canvas, const ColourBar& bar) {
  constexpr double kPoint = 22.0;  // [pixels]
  const PixelBox& box = bar.box;
  const double middle = box.x + 0.5 * box.width;
  const double upper = box.y + box.height;
  const int right = box.x + box.width;
  const double from = bar.map == skin_colour ? bar.bottom / bar.top : 0.0;
  canvas.image(box, [&](int, int j) { return bar.map(from + (1.0 - from) * (j + 0.5) / box.height); });
  canvas.frame(box, kInk, 1.0);
  const bool clipped = bar.most > bar.top;
  if (clipped) {
    canvas.polygon({{box.x, upper + 3}, {right, upper + 3}, {middle, upper + 3 + kPoint}}, bar.map(1.0));
    draw_fitted(canvas, right + 10, upper + 3 + 0.8 * kPoint, fmt::format("to {:.3g}", bar.most), {.size = 16},
                kPictureWidth - right - 16);
  }
  canvas.text(middle, upper + (clipped ? kPoint : 0.0) + 24, bar.label, {.size = 18, .align = Align::kCentre});
  for (const double tick : even_ticks(bar.bottom, bar.top, std::clamp(box.height / 60, 2, 8))) {
    const double y = box.y + box.height * ((tick - bar.bottom) / (bar.top - bar.bottom));
    canvas.line({right, y}, {right + 6, y}, kInk, 1.0);
    draw_fitted(canvas, right + 10, y, fmt::format("{:.6g}", tick), {.size = 16}, kPictureWidth - right - 16);
  }
}

void draw_scale_bar(Canvas& canvas, const PixelBox& panel, double metres_per_pixel) {
  const double length = tick_step(0.3 * panel.width * metres_per_pixel, 2);
  const double left = panel.x + 8.0;
  const double right = left + length / metres_per_pixel;
  const double y = panel.y + 12.0;
  canvas.line({left, y}, {right, y}, kInk, 3.0);
  canvas.text(right + 8.0, y, fmt::format("{:.6g} mm", 1e3 * length), {.size = 15});
}

PixelBox PanelGrid::panel(int i) const {
  return {left + i % columns * (width + kGap), top - (i / columns + 1) * (above + height) - i / columns * kGap, width,
          height};
}

PanelGrid filled_grid(const PixelBox& room, int count, int columns, int above) {
  const int rows = (count + columns - 1) / columns;
  return {.left = room.x,
          .top = room.y + room.height,
          .width = (room.width - (columns - 1) * PanelGrid::kGap) / columns,
          .height = (room.height - (rows - 1) * PanelGrid::kGap) / rows - above,
          .columns = columns,
          .above = above};
}

double shown_scale(const PanelGrid& grid, const Eigen::Vector2d& size) {
  return std::min(grid.width / size.x(), grid.height / size.y());
}

PanelGrid fitted_grid(const PixelBox& room, int count, int above, const Eigen::Vector2d& size) {
  PanelGrid best = filled_grid(room, count, 1, above);
  for (int columns = 2; columns <= count; ++columns) {
    const PanelGrid grid = filled_grid(room, count, columns, above);
    if (shown_scale(grid, size) > shown_scale(best, size)) {
      best = grid;
    }
  }
  return best;
}

}  // namespace touchfield
