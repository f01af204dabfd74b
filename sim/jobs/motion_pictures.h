#pragma once

#include <string>

#include "sim/run/motion_data.h"
#include "sim/run/run_directory.h"

namespace touchfield {

/// strip.png with six of the motion's instants, where it has any, and report.html.
///
/// results   as of motion_report
void draw_motion_page(const Motion& motion, const RunDirectory& directory, const std::string& results = "");

}  // namespace touchfield
