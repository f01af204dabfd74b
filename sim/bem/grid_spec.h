#pragma once

#include "sim/bem/grid_loops.h"
#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Numbers that a sum by a grid is made with (choose_grid finds them).
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

/// The smallest even number from `least` on without a prime factor above 5, for Fourier transforms.
int transform_size(int least);

/// The finest tolerance that sums by a grid are made for: beyond, more points and reach do not make them more accurate.
/// Below kFinestSingleGrid they need double precision.
inline constexpr double kFinestGridTolerance = 1e-8;
inline constexpr double kFinestSingleGrid = 3e-6;

/// What a grid's cost depends on of a body.
struct GridBody {
  Vector3 extent;  // [m]
  double area;     // [m2]
  double faces;
};
GridBody grid_body(const TriangleMesh& mesh);

struct GridChoice {
  GridSpec spec{};
  double seconds = 0;  // of one thread for a product with one column, on a processor of 2020
  double memory = 0;   // of the grid and its symbol [bytes]
};

/// The cheapest GridSpec with which a product of D + eta W differs from the direct sum by at most the tolerance:
///
///   |difference| <= tolerance max(|x|, |(D + eta W) x|)   (2-norms)
///
/// Three errors are kept below a half, a quarter and a quarter of it, with r_c = 1.25 beta h / pi, k_c = pi / (1.25 h):
///
///   mollifier      0.018 (k_c / k)^2 exp(-0.93 beta sqrt(1 - (k / k_c)^2))   its spectrum beyond k_c
///   window         2.3 (2 pi / (k h)) exp(-2.03 w)                          its images
///   continuation   0.05 exp(-m (pi - k h) / 2)                              over m steps
///
/// fitted to hands of 3.2 to 0.97 mm edge, a ball and a rod at 40 kHz, h from 0.07 to 0.25 wavelengths. Where eta = i
/// gamma is larger than i / k the first grows with it. What is left free, h, makes the cost small: a finer grid has
/// more points, a coarser one more faces within reach.
///
/// wavenumber   k + i alpha [1/m], k > 0
/// tolerance    from kFinestGridTolerance on
GridChoice choose_grid(const GridBody& body, const Complex& wavenumber, double gamma, double tolerance);

}  // namespace touchfield
