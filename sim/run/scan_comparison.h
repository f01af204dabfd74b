#pragma once

#include <string>
#include <vector>

#include "sim/core/json.h"
#include "sim/run/run_data.h"
#include "sim/scene/number_files.h"

namespace touchfield {

/// How a computed field c has to be scaled and turned to meet a measured one m in the least squares' sense:
///
///   complex      s exp(i turn) = c^H m / c^H c,   r = |c^H m| / (|c| |m|)
///   magnitudes   s = |c|.|m| / |c|.|c|,           r = |c|.|m| / (||c|| ||m||)
///
/// What is left, |s exp(i turn) c - m| / |m|, is sqrt(1 - r^2).
struct ScanFit {
  double scale = kNotComputed;     // s, measured over computed
  double turn = kNotComputed;      // [rad], -pi..pi; not computed of magnitudes
  double relative = kNotComputed;  // of all points, L2
  double correlation = kNotComputed;
  double about_means = kNotComputed;  // of magnitudes: the correlation of what is left without their means
};

/// A measured point and what the run has there.
struct ScanPoint {
  int line = 0;           // of the file
  Vector3 at;             // where it was measured [m]
  Complex measured;       // as in the file
  Complex computed;       // scaled and turned; of magnitudes its magnitude
  double difference = 0;  // |computed - measured|
  std::string left_out;   // why it does not count; empty: it does
};

/// A run's field against measured points.
struct ScanComparison {
  ScanFit fit;
  double conjugate_correlation = kNotComputed;  // of complex data had it the time factor exp(+i omega t)
  std::vector<ScanPoint> points;
  std::size_t used = 0;
  std::size_t largest = 0;                 // number of the point with the largest difference
  double largest_relative = kNotComputed;  // that over the largest |measured|
};

/// Compares the field of one method with the measured values. Points that lie inside the body or on a transducer do not
/// count. Points nearer to the skin than the longest edge of the face there do not count either. So near, the field
/// shows that the pressure is constant on each face.
///
/// throws   InputError if the run has no such method, no field (see run_field) or fewer than two points count
ScanComparison compare_scan(const Run& run, const Wave& wave, const std::string& method,
                            const MeasuredPoints& measured);

/// Whether each of some points lies off the body and no nearer to its skin than the longest edge of the face there.
std::vector<bool> clear_points(const Run& run, const Points& points);

/// What came out but for the points, and a CSV file with one row per point.
Json scan_value(const ScanComparison& comparison, bool complex);

/// The points, or those that were left out, with what was measured and computed.
Json scan_points(const ScanComparison& comparison, bool complex, bool only_left_out = false);
void write_scan_csv(const std::string& path, const ScanComparison& comparison, bool complex);

}  // namespace touchfield
