#pragma once

#include <string>
#include <vector>

#include "sim/pictures/canvas.h"
#include "sim/pictures/skin_sight.h"
#include "sim/run/run_data.h"

/// What all pictures of a run share.
namespace touchfield {

inline constexpr int kPictureWidth = 1200;  // [pixels]
inline constexpr int kPictureHeight = 900;  // [pixels]

/// The least of 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten that is not below value; 1 for a value that is
/// not positive.
double round_above(double value);

/// Steps of 1, 2 or 5 times a power of ten that cut a length of `range` > 0 into at most `most` pieces.
double tick_step(double range, int most);

/// Multiples of such a step from low to high > low, ascending; 0 among them is not -0.
std::vector<double> even_ticks(double low, double high, int most);

/// The value that a share of the finite ones among `values` does not exceed; 0 if there is none.
double quantile(std::vector<double> values, double share);

/// The end of the colours of every picture of a skin [Pa], rounded up. It is the largest of the pressures' 99.5th
/// percentiles, so that a single hot face does not darken all others. Where a pressure is wanted it is, before
/// rounding, at least that and at most twice that. A method that presses ten times as hard then leaves the others their
/// colours.
double skin_top(double most_wanted, const std::vector<const Eigen::VectorXcd*>& pressures);

/// The same of a scale that ends at `most` without a wanted pressure.
double skin_top(double most_wanted, double most);

/// The share of the faces of a field or a skin that colours end at.
inline constexpr double kTopShare = 0.995;

/// |p| of each.
std::vector<double> magnitudes(const Eigen::VectorXcd& pressure);

/// Says in the picture's file which run it shows: Software and Source are of the program that computed it, Scene hash
/// is of its scene.
void describe(Canvas& canvas, const Provenance& provenance);

/// Text, made smaller where it would be wider than `most` [pixels].
void draw_fitted(Canvas& canvas, double x, double y, const std::string& text, TextStyle style, double most);

/// The name of results, and whether they are of a hand alone, by their notes.
std::string picture_title(const std::string& name, const std::vector<std::string>& notes);

/// A bold line and one below it, at the top of the picture; the first is its file's Description too.
void draw_title(Canvas& canvas, const std::string& title, const std::string& subtitle);

/// Lines at the foot of the picture.
void draw_caption(Canvas& canvas, const std::string& first, const std::string& second);

/// What the colours of a picture mean: those of values from `bottom` to `top`. The map's 0 is the bottom, or 0 if the
/// bottom is suction.
struct ColourBar {
  PixelBox box = {1085, 130, 26, 640};  // at the right side of the picture
  std::string label;
  double bottom = 0.0;
  double top = 1.0;
  Colour (*map)(double) = viridis;
  double most = 0.0;  // of the values: above `top` the bar ends in a point, with this number
  bool has_suction = false;
};

void draw_colour_bar(Canvas& canvas, const ColourBar& bar);

/// The colours of a pressure on the skin.
struct SkinScale {
  double top = 1.0;     // [Pa]
  double bottom = 0.0;  // [Pa], < 0: of suction
  const char* label = "|p| [kPa]";
  double unit = 1e3;  // of the label [Pa]
};

/// Of pressures on the skin, the largest of which is `most` [Pa].
ColourBar skin_bar(const SkinScale& scale, double most);

/// The colours of pressures on the skin, one per face, up to `top`; both in one unit.
std::vector<Colour> skin_colours(const Eigen::VectorXd& values, double top);

/// A mesh in a panel of its own one's size, one colour per face. In a PDF or SVG, which are made for
/// print, it is finer than the picture.
void draw_sight(Canvas& canvas, const SkinSight& sight, const std::vector<Colour>& colours, const PixelBox& panel);
void draw_sight(Canvas& canvas, const SkinSight& sight, const ColourAt& colour_at, const PixelBox& panel);

/// A bar with its length in mm, below a panel at its left.
void draw_scale_bar(Canvas& canvas, const PixelBox& panel, double metres_per_pixel);

/// A marker of a plot; its shape and colour, which people with colour-blindness tell apart, follow from its number.
void draw_marker(Canvas& canvas, std::size_t number, const Eigen::Vector2d& centre, bool outlined);
Colour marker_colour(std::size_t number);

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
inline double axis_begin(double least, double most) { return least > 0.0 && least < 0.5 * most ? 0.0 : least; }

/// A plot's frame, with lines and labels at the ticks of y and lines at those of x, whose labels `labelled` asks for.
void draw_plot(Canvas& canvas, const PixelBox& plot, const LinearAxis& x, const LinearAxis& y, bool labelled = true);

}  // namespace touchfield
