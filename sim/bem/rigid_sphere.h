#pragma once

#include "sim/acoustics/medium.h"

namespace touchfield {

/// Pressure of a rigid sphere in a plane wave of amplitude 1, on its surface.
///
///   p(theta) = sum_n (2n+1) i^n P_n(cos theta) i / ((ka)^2 h_n'(ka))
///
/// wave        k from a Medium and a frequency; its absorption must be 0
/// radius      a [m], > 0
/// cos_theta   M values, theta from the direction of travel; the lit pole is -1
/// returns     M complex pressures; phase 0 at the centre in the wave's absence; absolute error below 1e-10 for
///             ka <= 100
/// throws      InputError if radius <= 0 or the medium absorbs
/// source      Bowman, Senior, Uslenghi, Electromagnetic and Acoustic Scattering by Simple Shapes, ch. 10
Eigen::VectorXcd rigid_sphere_plane_wave(const Wave& wave, double radius, const Eigen::VectorXd& cos_theta);

/// The same for a point source g = exp(ikr)/(4 pi r) at distance r0 >= 1.5 a from the centre,
///
///   p(theta) = (ik / 4 pi) sum_n (2n+1) h_n(k r0) P_n(cos theta) i / ((ka)^2 h_n'(ka))
///
/// cos_theta   theta from the direction of the source
/// accuracy    relative error below 1e-9 for ka <= 100; InputError if r0 < 1.5 a or k r0 > 1e4
Eigen::VectorXcd rigid_sphere_point_source(const Wave& wave, double radius, double source_distance,
                                           const Eigen::VectorXd& cos_theta);

/// Time-averaged force of a plane wave of amplitude p0 on a rigid sphere that is held still, along its travel [N].
///
///   F = pi a^2 p0^2 / (2 rho c^2) Y,   Y = -(4 / (ka)^2) sum_n (n+1) (Re(s_n + s_(n+1)) + 2 Re(s_n conj(s_(n+1)))),
///   s_n = -j_n'(ka) / h_n'(ka)
///
/// amplitude   p0 [Pa]
/// accuracy    relative error below 1e-9 for 0.1 <= ka <= 100
/// source      Hasegawa, Saka, Inoue, Matsuzawa, J. Acoust. Soc. Jpn. (E) 9, 1988; King 1934 for small ka
double rigid_sphere_force(const Wave& wave, double radius, double amplitude);

}  // namespace touchfield
