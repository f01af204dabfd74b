#pragma once

#include <string>
#include <vector>

#include "sim/assess/scan_setting.h"
#include "sim/scene/measured_points.h"

namespace touchfield {

/// Finds how a scan was taken. With the fitted setting, the field of a run, times one factor (as of fit_scan), meets
/// the measured values in the least squares' sense. If the place is asked for, the start is first moved along x and y
/// to the best fit. This search covers up to two wavelengths in steps of half a wavelength. Levenberg-Marquardt
/// continues from there. At most 1,000 of the points that count are used, in the search at most 300, evenly picked.
///
/// start      held where no group of `groups` names it
/// groups     of kScanValueInfo
/// throws     InputError if the points do not determine a value that is asked for, if they are not more than the
///            values, and as compare_scan
ScanSetting fit_scan_setting(const Run& run, const Wave& wave, const std::string& method,
                             const MeasuredPoints& measured, const ScanSetting& start,
                             const std::vector<std::string>& groups);

}  // namespace touchfield
