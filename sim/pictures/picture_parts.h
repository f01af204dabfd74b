#pragma once

#include <string>
#include <vector>

#include "sim/pictures/canvas.h"
#include "sim/run/run_data.h"

/// What all pictures share.
namespace touchfield {

inline constexpr int kPictureWidth = 1200;  // [pixels]
inline constexpr int kPictureHeight = 900;  // [pixels]

/// Of a picture with that many panels in a row or a few rows [pixels]: taller above six.
inline int picture_height(int panels) { return panels > 6 ? 1600 : kPictureHeight; }

/// The least of 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten that is not below value; 1 for a value that is
/// not positive.
double round_above(double value);

/// Steps of 1, 2 or 5 times a power of ten that cut a length of `range` > 0 into at most `most` pieces.
double tick_step(double range, int most);

/// Multiples of such a step from low to high > low, ascending; 0 among them is not -0.
std::vector<double> even_ticks(double low, double high, int most);

/// The value that a share of the finite ones among `values` does not exceed; 0 if there is none.
double quantile(std::vector<double> values, double share);

/// The share of the faces or points of a method whose values colours reach.
inline constexpr double kTopShare = 0.995;

/// Says in the picture's file which run it shows: Software and Source are of the program that computed it, Scene hash
/// is of its scene.
void describe(Canvas& canvas, const Provenance& provenance);

/// Text, made smaller where it would be wider than `most` [pixels].
void draw_fitted(Canvas& canvas, double x, double y, const std::string& text, TextStyle style, double most);

/// The name of results, and whether they are of a hand alone, by their notes.
std::string picture_title(const std::string& name, const std::vector<std::string>& notes);

/// What a picture says.
struct PictureTexts {
  std::string title;       // bold; its file's Description too
  std::string subtitle{};  // below it
  std::string caption{};   // below what is shown
  std::string foot{};      // small, below that
};

void draw_texts(Canvas& canvas, const PictureTexts& texts);

/// What the colours of a picture mean: those of values from `bottom` to `top`. The map's 0 is the bottom, or 0 of
/// skin_colour, whose bottom may be suction.
struct ColourBar {
  PixelBox box = {1085, 130, 26, 640};  // at the right side of the picture
  std::string label;
  double bottom = 0.0;
  double top = 1.0;
  Colour (*map)(double) = viridis;
  double most = 0.0;  // of the values: above `top` the bar ends in a point, with this number
};

void draw_colour_bar(Canvas& canvas, const ColourBar& bar);

/// A bar with its length in mm, in the lower left corner of a panel.
void draw_scale_bar(Canvas& canvas, const PixelBox& panel, double metres_per_pixel);

/// Panels of one size in rows, each with room above it for texts.
struct PanelGrid {
  static constexpr int kGap = 8;  // between panels

  int left;    // side of the first
  int top;     // of the room above the first
  int width;   // of a panel
  int height;  // of a panel
  int columns;
  int above;  // height of the room above each

  /// From the upper left one, row by row.
  PixelBox panel(int i) const;
};

/// As many panels as fit a room with that many columns.
PanelGrid filled_grid(const PixelBox& room, int count, int columns, int above);

/// The one whose panels show something of a size [any unit] largest.
PanelGrid fitted_grid(const PixelBox& room, int count, int above, const Eigen::Vector2d& size);

/// How large a panel shows it [pixels per unit].
double shown_scale(const PanelGrid& grid, const Eigen::Vector2d& size);

}  // namespace touchfield
