#pragma once

#include <limits>
#include <vector>

#include "sim/acoustics/medium.h"
#include "sim/field/surface_gradient.h"
#include "sim/field/target.h"

namespace touchfield {

inline constexpr double kNotComputed = std::numeric_limits<double>::quiet_NaN();

/// What a method reached. docs/metrics.md defines each; NaN where not computed.
struct Metrics {
  double relative_error = kNotComputed;      // after the best scale
  double relative_error_raw = kNotComputed;  // at scale 1
  double scale = kNotComputed;               // the best scale
  double correlation = kNotComputed;
  double leakage = kNotComputed;  // share of sum A |p|^2 outside the target
  double mean_inside_pa = kNotComputed;
  double reached_share = kNotComputed;  // mean_inside_pa over the mean that is wanted there
  double cv_inside = kNotComputed;      // standard deviation over mean of |p| inside
  double width_mm = kNotComputed;
  double width_wanted_mm = kNotComputed;
  double length_wanted_mm = kNotComputed;
  double peak_pa = kNotComputed;
  double relative_error_radiation = kNotComputed;  // of the radiation pressure P, after the best scale
  double width_radiation_mm = kNotComputed;
  double length_radiation_mm = kNotComputed;
  double force_target_n = kNotComputed;
  double force_elsewhere_n = kNotComputed;      // sum A P outside the target
  double abs_force_elsewhere_n = kNotComputed;  // sum A |P| there
  double loudest_elsewhere = kNotComputed;      // largest P outside the target over the mean on it
  double cost = kNotComputed;                   // the method's own, at its end
  double cost_skin = kNotComputed;              // surface's, at the method's best common level up to 1
  double cost_bound = kNotComputed;             // the least that surface's can be at full level
  double optimality_gap = kNotComputed;
  double error_bound = kNotComputed;               // sqrt(cost_bound / cost of silence)
  double cost_radiation = kNotComputed;            // radiation's, at the method's best common level up to 1
  double cost_radiation_bound = kNotComputed;      // the least that it can be
  double optimality_gap_radiation = kNotComputed;  // of both
  double power_share = kNotComputed;               // mean of the squares of the drives' amplitudes
  double iterations = kNotComputed;
  double seconds_solve = kNotComputed;
  double seconds_total = kNotComputed;
  double evaluation_difference = kNotComputed;         // from the evaluation, over the skin
  double evaluation_difference_target = kNotComputed;  // and over the target's surroundings
};

/// A metric's name as results spell it, its unit ("1" if none) and where it is kept.
struct MetricField {
  const char* name;
  const char* unit;
  double Metrics::*value;
  bool share = false;  // of a whole, which people read in percent
};

/// Every metric in the order of the results' columns. (`status` is text and kept with the solution.)
const std::vector<MetricField>& metric_fields();

/// Time-averaged radiation pressure on each face of a sound-hard skin, pushing inwards [Pa],
///
///   P = |p|^2 / (4 rho c^2) - rho |v_t|^2 / 4,   v_t = grad_t p / (i omega rho)
///
/// p [Pa] peak, M; grad_t by the SurfaceGradient of the mesh for the wave's k.
/// accuracy   docs/accuracy.md, "Forces"
Eigen::VectorXd radiation_pressure(const SurfaceGradient& gradient, const Wave& wave, const Eigen::VectorXcd& pressure);

/// Of a pressure without flow along the skin, over its square: 1 / (4 rho c^2) [1/Pa].
double radiation_per_square(const Medium& medium);

/// Full width at half maximum of a pressure across a box [m], such as |p|^2 or P. It is averaged by area in bins of
/// 0.25 mm along an axis. It counts the skin that faces the target's side, within 2 mm of the box's middle plane
/// across the other axis. The maximum is that inside the box. The width reaches from the peak outwards to the first
/// crossings of its half, linear between bins. Skin faces the target's side where its normal has a positive product
/// with the target's mean normal.
///
/// values    M, of any sign
/// axis      of the box: 0, along which its width is, or 1, its length
/// returns   NaN if the box holds no bin, the maximum is not above 0, or the profile falls to half on no side or only
///           one
double half_maximum_width(const TriangleMesh& mesh, const TargetBox& box, const Target& target,
                          const Eigen::VectorXd& values, int axis = 0);

/// Extent of the skin in a box along one of these axes [m]; of a mask, that of the target's faces in it.
double wanted_width(const TriangleMesh& mesh, const TargetBox& box, const Target& target, int axis = 0);

/// Area-weighted mean of the wanted amplitudes over the target [Pa].
double wanted_mean(const TriangleMesh& mesh, const Target& target);

/// The metrics of a pattern; the rest stay NaN. With s the share of a face in the target, 0 off it:
///
///   relative_error       min over a of sqrt(sum s A (a |p| - p')^2 + (1 - s) A (a |p|)^2) / sqrt(sum s A p'^2)
///   relative_error_raw   the same at a = 1;  scale: that a
///   correlation          sum s A |p| p' / sqrt(sum A |p|^2 sum s A p'^2): relative_error^2 = 1 - correlation^2
///   leakage              sum of (1 - s) A |p|^2 over that of A |p|^2
///   mean_inside_pa, cv_inside   mean of |p| on the target by s A, standard deviation over mean
///   reached_share        mean_inside_pa over wanted_mean
///   peak_pa              largest |p| on any face
///   width_mm, width_wanted_mm   half_maximum_width of |p|^2, wanted_width
///   length_wanted_mm     wanted_width along the second axis
///
/// boxes      the target's; width and length are measured across the first
/// pressure   M [Pa]
Metrics pattern_metrics(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, const Target& target,
                        const Eigen::VectorXcd& pressure);

/// Those and the metrics of the radiation pressure P. The wanted one is P' = p'^2 / (4 rho c^2), along the normal.
///
///   relative_error_radiation   min over a >= 0 of sqrt(sum s A (a P - P')^2 + (1 - s) A (a P)^2) / sqrt(sum s A P'^2)
///   width_radiation_mm, length_radiation_mm   half_maximum_width of P along both axes
///   force_target_n, force_elsewhere_n   sum of s A P and of (1 - s) A P
///   abs_force_elsewhere_n      sum of (1 - s) A |P|: suction moves skin as a push does
///   loudest_elsewhere          largest P on a face with s = 0 over the mean of P on the target by s A. A face that the
///                              border cuts has one P for both of its parts, so it does not count here. NaN if the mean
///                              is not above 0 or no face has s = 0
///
/// radiation   M, of the pressure [Pa]
Metrics metrics_of(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, const Target& target,
                   const Eigen::VectorXcd& pressure, const Eigen::VectorXd& radiation);
/// With the radiation pressure that the wave's pressure makes.
Metrics metrics_of(const TriangleMesh& mesh, const Wave& wave, const std::vector<TargetBox>& boxes,
                   const Target& target, const Eigen::VectorXcd& pressure);

/// The metrics that need no target: peak_pa, and both forces elsewhere over the whole body.
Metrics metrics_of(const TriangleMesh& mesh, const Eigen::VectorXcd& pressure, const Eigen::VectorXd& radiation);

/// Sound pressure level of a sine, by its root mean square:
///
///   L = 20 log10(a / (sqrt(2) 20 uPa))
///
/// amplitude   a, the peak [Pa]
/// returns     [dB]; -infinity of silence
double sound_level(double amplitude);

/// A limit that somebody has published for airborne ultrasound at the ear, in a third-octave band.
struct ExposureLimit {
  const char* source;  // who, and the year
  const char* people;  // whom it is for
  double level;        // [dB re 20 uPa]
};

/// The published limits in the third-octave band of a frequency. They are figures of others, no assessment of safety.
///
/// frequency   [Hz]
/// returns     nothing in bands for which the sources give no limit: below that of 20 kHz, above that of 100 kHz
/// sources     INIRC-IRPA, Health Physics 46 (1984) 969; Health Canada, Safety Code 24 (1991); ACGIH, Threshold Limit
///             Values (2004), without the 30 dB that it adds where the body touches nothing that carries the sound
std::vector<ExposureLimit> exposure_limits(double frequency);

}  // namespace touchfield
