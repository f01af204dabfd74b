#pragma once

#include <string>
#include <vector>

#include "sim/core/types.h"
#include "sim/pictures/picture_format.h"
#include "sim/run/sweep_files.h"

namespace touchfield {

/// throws   InputError if there is no such metric
void require_metric(const std::string& name);

/// Whether a sweep was drawn, and if not, why: what follows "no plot: ".
struct SweepPlot {
  std::string why_not;

  explicit operator bool() const { return why_not.empty(); }
};

/// A picture of 1200 x 900 pixels of a metric against one input of the sweep. The input is the number with most values,
/// a seed only if there is no other. The picture has one line per method. Where other inputs differ too, it has one
/// panel per method with one line per combination of their values, at most 12.
///
/// Values are averaged only over seeds and over cases with the same inputs. The caption then says so, and bars show the
/// range of the values. Some inputs have one value for each value of the axis (a zip, random draws). They have no line
/// of their own, the caption names them, and points are not joined.
///
/// path     where it lands, whole or not at all; nothing is written where nothing can be drawn
/// throws   InputError on an unknown metric; IoError if it cannot be written
SweepPlot draw_sweep(const std::string& path, const SweepSummary& summary, const std::string& metric,
                     PictureFormat format);

/// A point of a plot, and the line that it belongs to.
struct PlotPoint {
  std::string line;
  double x;
  double y;
};

struct PlotTexts {
  std::string title;
  std::string x;
  std::string y;
};

/// The same picture of any points, a line for each name. Points of a line at one place are drawn as their mean, with a
/// bar from the least to the largest.
/// throws   IoError if it cannot be written
void draw_points(const std::string& path, const PlotTexts& texts, const std::vector<PlotPoint>& points,
                 PictureFormat format);

/// What pictures of a scan say beside it.
struct ScanPicture {
  std::string title;  // in bold above
  std::string first;  // lines below
  std::string second;
};

/// A picture of 1200 x 900 pixels: what was measured at a point against what was computed there, a dot each, and the
/// line on which they are the same.
///
/// path                where it lands, whole or not at all
/// computed, measured  magnitudes, of equally many points
/// throws              IoError if it cannot be written
void draw_scan(const std::string& path, const ScanPicture& picture, const Eigen::VectorXd& computed,
               const Eigen::VectorXd& measured, PictureFormat format);

}  // namespace touchfield
