#pragma once

#include <string>

#include "sim/run/motion_data.h"
#include "sim/view/view_data.h"

namespace touchfield {

/// The page of a motion or a pattern: the skin at as many of its instants as make a page of about 6 MB, and curves over
/// time. Each curve has a line per method:
///
///   error of |p| [%]          relative_error at each score
///   error of P [%]            relative_error_radiation, of a pattern at its instants
///   mean |p| in target [Pa]   mean_inside_pa at each score; `wanted` is mean_inside_pa / reached_share
///   displacement [mm]         of the target's patch since the sample of the frame that is shown
///   age [ms]                  of that sample
///   latency [ms]              of each frame, from its sample to the array, when it is shown
///   |p| at places [Pa]        of a pattern: a line per place that is watched
///
/// A line without a finite value, or of zeros alone, is left out. A line of more than 2000 values keeps the least and
/// the largest of each of 1000 stretches, and a NaN of each that has one. The radiation pressure is that of metrics.h,
/// by the medium and frequency of the motion's scene; there is none if that cannot be read.
ViewData motion_view(const Motion& motion);

/// The page of a motion or a pattern: the view, its figures, warnings and provenance.
///
/// picture   as of view_page
/// results   as of motion_report
std::string motion_page(const Motion& motion, const std::string& picture, const std::string& results = "");

}  // namespace touchfield
