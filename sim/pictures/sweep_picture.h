#pragma once

#include <string>

#include "sim/pictures/picture_format.h"
#include "sim/store/sweep_files.h"

namespace touchfield {

/// throws   InputError if there is no such metric
void require_metric(const std::string& name);

/// A picture of 1200 x 900 pixels of a metric against the parameters whose values are numbers and differ: against one
/// of them a line a method through the means of its cases; against two of them a map a method, one colour scale for
/// all.
///
/// path     where it lands, whole or not at all
/// returns  false, and writes nothing, unless there are one or two such parameters and two values of one of them
/// throws   InputError on an unknown metric; IoError if it cannot be written
bool draw_sweep(const std::string& path, const SweepSummary& summary, const std::string& metric, PictureFormat format);

}  // namespace touchfield
