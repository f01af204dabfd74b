#pragma once

#include "sim/acoustics/transducer_array.h"

namespace touchfield {

/// Incident pressure of every channel at unit drive at every point, the matrix G.
///
///   G(j, n) = c_n a_n d(theta_jn) exp(i k r_jn) / r_jn      (plane wave: c a exp(i k axis.x_j))
///
/// c_n is the response of channel n, 1 if it is as designed.
///
/// points    3 x J [m], none on a transducer
/// returns   J x N [Pa]
Eigen::MatrixXcd incident_matrix(const TransducerArray& array, const Wave& wave, const Points& points);

/// Derivative of the incident pressure along a direction at each point, dG/dn [Pa/m].
///
/// directions   3 x J unit vectors
Eigen::MatrixXcd incident_derivative_matrix(const TransducerArray& array, const Wave& wave, const Points& points,
                                            const Points& directions);

/// Both in single precision, at less than half the time.
///
/// accuracy   1e-4 of the largest amplitude / r, a derivative k times as much, where k r is at most 300
Eigen::MatrixXcf incident_matrix_single(const TransducerArray& array, const Wave& wave, const Points& points);
Eigen::MatrixXcf incident_derivative_matrix_single(const TransducerArray& array, const Wave& wave, const Points& points,
                                                   const Points& directions);

/// Incident pressure of a driven array, G q, without forming G.
///
/// drive     N x S: complex drives q_n (amplitude 0..1 times exp(i phi)), one column a solution
/// single    whether the sums over channels are in single precision, with an error of 1e-6 of the largest there could
///           be
/// returns   J x S [Pa]
Eigen::MatrixXcd incident_pressure(const TransducerArray& array, const Wave& wave, const Points& points,
                                   const Eigen::MatrixXcd& drive, bool single = false);

/// Its derivative along a direction at each point, without forming dG/dn: J x S [Pa/m].
Eigen::MatrixXcd incident_derivative(const TransducerArray& array, const Wave& wave, const Points& points,
                                     const Points& directions, const Eigen::MatrixXcd& drive, bool single = false);

/// Coefficient of nonlinearity of air, beta = (gamma + 1) / 2.
inline constexpr double kNonlinearityOfAir = 1.2;

/// How far the sound of a driven array has steepened on a straight way, as a share of the way at which a shock forms:
///
///   sigma = integral over the way of beta k |p_inc| / (rho c^2) ds
///
/// of the incident field alone, by the midpoint rule. At 1 a plane wave without losses has a vertical front. A focused
/// wave is counted by its local pressure, as if it were plane there.
///
/// drive     N: complex drives, amplitude 0..1
/// from, to  ends of the way [m], at least a wavelength from every transducer (wave_front_begin)
/// points    > 0
/// accuracy  1e-4 relative at 400 points on a way of 30 wavelengths that begins one wavelength from a transducer
/// source    Blackstock, Hamilton, Pierce in Hamilton, Blackstock: Nonlinear Acoustics (1998), ch. 4
double shock_distance_share(const TransducerArray& array, const Wave& wave, const Eigen::VectorXcd& drive,
                            const Vector3& from, const Vector3& to, int points = 400);

/// The point from which the way from the array's centre to `to` counts. The centre is the mean of the transducers. The
/// way counts from the first point after which no transducer is nearer than a wavelength, or from `to` itself if there
/// is no such point.
///
/// Before that the array has no common front, only the near field of each transducer. P0 d/r, the law of a point, does
/// not hold there: its integral has no bound towards a transducer in the centre. The pressure before a real face of
/// radius b and velocity u is at most 2 rho c u = 4 P0 / (k b^2). So the part that is left out is at most
/// 4 beta P0 lambda / (rho c^2 b^2). This is 0.06 for an AUTD3's transducer.
///
/// array   of transducers; a plane wave has no centre
/// throws  std::logic_error on a plane wave
Vector3 wave_front_begin(const TransducerArray& array, const Wave& wave, const Vector3& to);

/// Amplitude of the n-th harmonic of a plane wave without losses over the amplitude that it began with, by Fubini's
/// series: 2 J_n(n sigma) / (n sigma).
///
/// n       1: the fundamental
/// sigma   0 to 1, before the shock
double plane_wave_harmonic(int n, double sigma);

}  // namespace touchfield
