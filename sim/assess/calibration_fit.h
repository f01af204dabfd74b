#pragma once

#include <string>
#include <vector>

#include "sim/assess/scan_setting.h"
#include "sim/scene/measured_points.h"

namespace touchfield {

/// What a complex scan m says of the channels of a run, whose drives q are known:
///
///   m = A y + s p_s + noise,   A = G diag(q),   y = s c
///
/// G is channel_readings of channels as designed, c_n the response of channel n, s the common factor of fit_scan, and
/// p_s what the body of the run scatters. The estimate is the most probable one, with a standard deviation of 0.5 of
/// the responses as the prior:
///
///   min |A y - m + s p_s|^2 / sigma^2 + |y - s|^2 / (0.5 |s|)^2
///
/// The noise sigma is that left by plain least squares. A common factor of all responses cannot be told from s: the
/// median gain is 1 and the sum of c is real.
struct CalibrationFit {
  ChannelResponse response;  // gain 0: dead
  Eigen::VectorXd error;     // N: standard deviation of the response before dead channels were set to 0
  double noise = 0;          // sigma over the root mean square of m
  int dead = 0;
};

/// A channel whose gain is below this is dead.
inline constexpr double kDeadGain = 0.2;
/// More than this standard deviation of a response is no estimate.
inline constexpr double kMostResponseError = 0.1;

/// throws   InputError if the scan has no phases, fewer points that count than 1.2 per channel, a channel that is not
///          driven, or one whose response would have a standard deviation above kMostResponseError
CalibrationFit fit_calibration(const Run& run, const Wave& wave, const std::string& method,
                               const MeasuredPoints& measured, const ScanSetting& setting);

/// The table that array.calibration.file reads.
void write_calibration(const std::string& path, const ChannelResponse& response);

}  // namespace touchfield
