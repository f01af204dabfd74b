#pragma once

#include "sim/acoustics/medium.h"
#include "sim/field/metrics.h"
#include "sim/field/surface_gradient.h"
#include "sim/field/target.h"

namespace touchfield {

/// Time-averaged radiation pressure on each face of a sound-hard skin, pushing inwards [Pa],
///
///   P = |p|^2 / (4 rho c^2) - rho |v_t|^2 / 4,   v_t = grad_t p / (i omega rho)
///
/// p [Pa] peak, M; grad_t by the SurfaceGradient of the mesh for the wave's k.
/// accuracy   docs/accuracy.md, "Forces"
Eigen::VectorXd radiation_pressure(const SurfaceGradient& gradient, const Wave& wave, const Eigen::VectorXcd& pressure);

/// Full width at half maximum of |p|^2 across a box [m]. |p|^2 is averaged by area in bins of 0.25 mm along the width
/// axis. It counts the skin that faces the target's side, within 2 mm of the box's middle plane across its second axis.
/// The maximum is that inside the box. The width reaches from the peak outwards to the first crossings of its half,
/// linear between bins. Skin faces the target's side where its normal has a positive product with the target's mean
/// normal.
///
/// returns   NaN if the box holds no bin or the profile falls to half on no side or only one
double half_maximum_width(const TriangleMesh& mesh, const TargetBox& box, const Target& target,
                          const Eigen::VectorXcd& pressure);

/// Extent of the target faces of the first box along its width axis, vertices included [m].
double wanted_width(const TriangleMesh& mesh, const TargetBox& box, const Target& target);

/// Area-weighted mean of the wanted amplitudes over the target's faces [Pa].
double wanted_mean(const TriangleMesh& mesh, const Target& target);

/// The metrics of a pattern; the rest stay NaN.
///
///   relative_error       min over a of || a |p| - p' || / || p' ||, area-weighted over all faces, p' = 0 off target
///   relative_error_raw   the same at a = 1;  scale: that a
///   correlation          sum A |p| p' / (|| p || || p' ||), so that relative_error^2 = 1 - correlation^2
///   leakage              sum of A |p|^2 off target over that of all faces
///   mean_inside_pa, cv_inside   area-weighted mean of |p| on the target, standard deviation over mean
///   reached_share        mean_inside_pa over wanted_mean
///   peak_pa              largest |p| on any face
///   width_mm, width_wanted_mm   half_maximum_width, wanted_width
///
/// boxes      the target's; width is measured across the first
/// pressure   M [Pa]
Metrics pattern_metrics(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, const Target& target,
                        const Eigen::VectorXcd& pressure);

/// Those and
///
///   force_target_n, force_elsewhere_n   sum of A P over the target's faces and over the others
///
/// gradient   of the mesh, for the wave's k; left out, it is made again
Metrics metrics_of(const TriangleMesh& mesh, const SurfaceGradient& gradient, const Wave& wave,
                   const std::vector<TargetBox>& boxes, const Target& target, const Eigen::VectorXcd& pressure);
Metrics metrics_of(const TriangleMesh& mesh, const Wave& wave, const std::vector<TargetBox>& boxes,
                   const Target& target, const Eigen::VectorXcd& pressure);

/// The metrics that need no target: peak_pa, and force_elsewhere_n over the whole body.
Metrics metrics_of(const TriangleMesh& mesh, const SurfaceGradient& gradient, const Wave& wave,
                   const Eigen::VectorXcd& pressure);

}  // namespace touchfield
