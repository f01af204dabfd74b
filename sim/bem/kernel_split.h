#pragma once

#include "sim/bem/grid_loops.h"
#include "sim/core/types.h"

namespace touchfield {

/// Numbers that a sum by a grid is made with (grid_spec.h chooses them).
struct GridSpec {
  double step = 0;          // h of the grid [m]
  int width = 0;            // w: points of the window along an axis
  double window_shape = 0;  // of the window, Kaiser and Bessel's beta
  double reach = 0;         // r_c [m]: beyond it the smooth part is the kernel itself
  double shape = 0;         // of the mollifier, likewise
  int margin = 0;           // steps beyond the body over which the kernel is continued smoothly
  double bend_shape = 0;    // of that continuation, a step of margin
  bool single = true;       // single precision will do
};

/// exp(i kappa r) / (4 pi r) = g split into a part that vanishes beyond a reach r_c and a smooth one. With a radial
/// mollifier chi of that support whose Fourier transform is 1 at |xi| = kappa, the mean value property gives
/// (chi * g)(r) = g(r) for r >= r_c, and below it
///
///   chi(r) = c I_0(beta sqrt(1 - (r/r_c)^2)),
///   4 pi r (g - chi * g)(r) = v(r) = int_r^r_c 4 pi s chi(s) sin(kappa (s - r)) / kappa ds,   v(0) = 1 (which sets c),
///   v'' = 4 pi r chi - kappa^2 v.
///
/// The smooth part chi * g has the spectrum of chi over xi^2 - kappa^2, negligible beyond beta / r_c. For real kappa
/// the local part is real.
///
/// source   Bruno, Kunyansky, J. Comput. Phys. 169 (2001) 80; Beylkin, Kurcz, Monzon, J. Comput. Phys. 228 (2009) 2770
class KernelSplit {
 public:
  /// kappa   k + i alpha [1/m], or 0: the static kernel 1 / (4 pi r)
  KernelSplit(const Complex& kappa, double reach, double shape);

  /// (chi * g)(r) [1/m], r >= 0; relative accuracy 1e-12 at 0 and from a hundredth of the reach on.
  Complex smooth(double r) const;

  /// v, a = v - r v' and b = r^2 v'' - 3 r v' + 3 v as polynomials. The local part and its slopes are made of these. At
  /// r = 0 they give the smooth part with the sign changed, so that a face adds nothing to itself.
  ///
  /// gamma   eta = i gamma [m]
  template <typename Real>
  LocalKernel<Real> local(double gamma) const;

 private:
  struct Radial {
    Complex v, slope, bend;  // v and its derivatives
  };
  Complex mollifier(double r) const;  // chi
  Radial radial(double r) const;      // r <= r_c

  Complex kappa_;
  double reach_;
  double shape_;
  Complex scale_ = 1.0;  // c
};

}  // namespace touchfield
