#pragma once

#include <string>

#include "sim/pictures/canvas.h"

namespace touchfield {

/// An axis of a plot whose ends are ticks.
struct LinearAxis {
  double low;
  double high;
  double step;
  double start;   // [pixels]
  double length;  // [pixels]

  /// Holds least..most in at most `pieces` steps and what rounding to ticks adds; what differs by rounding alone is one
  /// value, with room around it.
  LinearAxis(double least, double most, double start_pixel, double pixels, int pieces);

  double pixel(double value) const { return start + length * (value - low) / (high - low); }
  int tick_count() const;
  double tick(int i) const { return low + i * step; }
  /// The tick's value without the rounding of the sum it came from.
  std::string label(int i) const;
};

/// The beginning of an axis of values least..most. It is zero where that wastes less than half of the height, since a
/// difference then looks as large as it is.
double axis_begin(double least, double most);

/// A plot's frame, with lines and labels at the ticks of y and lines at those of x, whose labels `labelled` asks for.
void draw_plot(Canvas& canvas, const PixelBox& plot, const LinearAxis& x, const LinearAxis& y, bool labelled = true);

}  // namespace touchfield
