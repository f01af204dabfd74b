#include "sim/pictures/linear_axis.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/pictures/picture_parts.h"

namespace touchfield {

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

double axis_begin(double least, double most) { return least > 0.0 && least < 0.5 * most ? 0.0 : least; }

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
