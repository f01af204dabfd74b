#pragma once

#include <string>

#include "sim/pictures/picture_format.h"
#include "sim/store/sweep_files.h"

namespace touchfield {

/// throws   InputError if there is no such metric
void require_metric(const std::string& name);

/// Whether a sweep was drawn, and if not, why: what follows "no plot: ".
struct SweepPlot {
  std::string why_not;

  explicit operator bool() const { return why_not.empty(); }
};

/// A picture of 1200 x 900 pixels of a metric against one input of the sweep: the one that is a number and has most
/// values. It has one line per method. Where other inputs differ too, it has one panel per method with one line per
/// combination of their values, of which there may be 12. Only over seeds, and cases with the same inputs, are values
/// averaged, and the caption says so; bars show their spread. An input whose values go one by one with those of the
/// axis (a zip, random draws) has no line of its own; the caption names it, and points are not joined.
///
/// path     where it lands, whole or not at all; nothing is written where nothing can be drawn
/// throws   InputError on an unknown metric; IoError if it cannot be written
SweepPlot draw_sweep(const std::string& path, const SweepSummary& summary, const std::string& metric,
                     PictureFormat format);

}  // namespace touchfield
