#pragma once

#include <vector>

#include <Eigen/Core>

namespace touchfield {

struct SkinLayer {
  double thickness = 0.0;  // [m], > 0
  double shear = 0.0;      // |mu| at 200 Hz [Pa], > 0
};

/// Flat layers that are bonded to each other, linear, isotropic and viscoelastic.
///
/// mu(w) = shear (w / w200)^a e^(-i a pi/2),  a = 2/pi atan(tan_delta),  w200 = 2 pi 200 Hz
///
/// source     the power law of tissue: Fung, Biomechanics: Mechanical Properties of Living Tissues, ch. 7
struct LayeredSkin {
  std::vector<SkinLayer> layers;  // from the surface inwards, at least one
  bool on_bone = false;           // the last layer is bonded to rigid bone; otherwise it has no end
  double tan_delta = 0.4;         // Im / Re of mu, >= 0
  double density = 1050.0;        // [kg/m3]
  double speed = 1540.0;          // of pressure waves [m/s]
};

/// Motion at one depth per pressure of e^(i k x - i w t) on the surface; each array has one value per wavenumber.
struct SkinWaves {
  Eigen::ArrayXcd along;    // displacement along x [m/Pa]
  Eigen::ArrayXcd inwards;  // displacement along z, inwards [m/Pa]
  Eigen::ArrayXcd e_xx;     // strains [1/Pa]
  Eigen::ArrayXcd e_zz;
  Eigen::ArrayXcd e_xz;  // half of the angle
  double modulus = 0.0;  // |mu| at this depth [Pa]; at an interface that of the layer above
};

/// How the skin moves under an oscillating pressure, per wavenumber.
///
/// In each layer, with ks^2 = density w^2 / mu, kp = w / speed, q^2 = k^2 - kp^2 and s^2 = k^2 - ks^2, pressure waves
/// e^(-+ q z) and shear waves e^(-+ s z) run down and up. Those without loss run away from the surface. On a half-space
///
///   u_z(k, 0) = -q ks^2 / (mu R),   R = (2 k^2 - ks^2)^2 - 4 k^2 q s
///
/// Without loss this is infinite at the Rayleigh wave's k.
///
/// omega         w [rad/s], > 0
/// wavenumbers   k [rad/m], >= 0
/// depths        [m], >= 0 and not below the bone
/// returns       one element per depth
/// accuracy      1e-9 of the displacement; k up to 1e4 rad/m, layers of 0.1 to 12 mm, from 0.5 Hz
/// throws        InputError outside these ranges
/// source        Lamb, Phil. Trans. R. Soc. A 203 (1904) 1; layers: Kennett, Seismic Wave Propagation (1983), ch. 6
std::vector<SkinWaves> skin_waves(const LayeredSkin& skin, double omega, const Eigen::ArrayXd& wavenumbers,
                                  const std::vector<double>& depths);

}  // namespace touchfield
