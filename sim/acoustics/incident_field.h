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

}  // namespace touchfield
