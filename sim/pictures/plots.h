#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/pictures/picture_parts.h"
#include "sim/run/run_data.h"
#include "sim/run/sweep_files.h"

namespace touchfield {

/// A place of a line: a value, and the least and largest of those that it is the mean of.
struct PlotPoint {
  double x;
  double y;  // NaN breaks the line
  double low;
  double high;
  int count = 1;  // of these
};

struct PlotLine {
  std::string label;
  std::vector<PlotPoint> points;  // ascending in x
  std::string note{};             // below the label
  bool is_joined = true;
  bool is_marked = true;
};

struct PlotPanel {
  std::string label;  // of its vertical axis; panels of one label have one range
  std::vector<PlotLine> lines;
  std::string heading{};
};

/// A plot of panels above and beside each other with one horizontal axis and one legend.
struct Plot {
  PictureTexts texts;
  std::string x{};                  // label
  std::vector<PlotPanel> panels{};  // with the same lines in the same order
  int columns = 1;
  std::string legend{};                    // its heading
  std::optional<Provenance> provenance{};  // of what it shows
};

/// The panels of a plot with their axes, in a room of a picture [pixels]. Numbers of the axes are at the left and below
/// it, the legend is between it and the picture's right side.
void draw_panels(Canvas& canvas, const Plot& plot, const PixelBox& room);

/// A picture of 1200 x 900 pixels. Lines have colours and markers of their own; of lines of many points about ten are
/// marked. Bars go from the least to the largest of what a point is the mean of.
///
/// path     where it lands, whole or not at all
/// throws   IoError if it cannot be written
void draw_plot(const std::string& path, const Plot& plot);

struct LineValue {
  std::string line;
  double x;
  double y;
};

/// One line for each name, in the order of their first values. Values at one place are one point, their mean. Those
/// that are not finite are left out.
std::vector<PlotLine> lines_through(const std::vector<LineValue>& values);

/// The colour of a line by its number; people with colour-blindness tell the first six apart.
Colour line_colour(std::size_t number);

/// throws   InputError if there is no such metric
void require_metric(const std::string& name);

/// A plot of a metric against one input of the sweep. The input is the number with most values, a seed only if there is
/// no other. The plot has one line per method. Where other inputs differ too, it has one panel per method with one line
/// per combination of their values, at most 12.
///
/// Values are averaged only over seeds and over cases with the same inputs. The caption then says so, and bars show the
/// range of the values. Some inputs have one value for each value of the axis (a zip, random draws). They have no line
/// of their own, the caption names them, and points are not joined.
///
/// path      where it lands, whole or not at all; nothing is written where nothing can be drawn
/// returns   why nothing is drawn, what follows "no plot: "; empty if it is drawn
/// throws    InputError on an unknown metric; IoError if it cannot be written
std::string draw_sweep(const std::string& path, const SweepSummary& summary, const std::string& metric);

}  // namespace touchfield
