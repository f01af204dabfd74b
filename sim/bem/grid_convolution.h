#pragma once

#include <array>
#include <vector>

#include "sim/bem/grid_loops.h"
#include "sim/bem/grid_spec.h"

namespace touchfield {

/// Discrete Fourier transforms of kGridLanes lines at once, number j of line l at [j kGridLanes + l]:
///
///   X_m = sum over j of x_j exp(-+ 2 pi i j m / n)
///
/// n          without a prime factor above 5
/// accuracy   a few roundings of the largest value
/// source     Stockham's order of Cooley and Tukey's stages: Van Loan, Computational Frameworks for the Fast Fourier
///            Transform (1992), ch. 1.7
template <typename Real>
class LineTransform {
 public:
  explicit LineTransform(int n);

  int size() const { return n_; }
  /// work   as long as re and im together
  void forward(Real* re, Real* im, Real* work) const { run(re, im, work); }
  void backward(Real* re, Real* im, Real* work) const { run(im, re, work); }

 private:
  void run(Real* re, Real* im, Real* work) const;

  int n_;
  std::vector<int> radices_;
  std::vector<Real> cos_, sin_;
};

extern template class LineTransform<float>;
extern template class LineTransform<double>;

/// Kaiser and Bessel's window along an axis, in steps of the grid: I_0(beta sqrt(1 - (2 s / w)^2)) / I_0(beta) where
/// |s| <= w / 2.
class KaiserWindow {
 public:
  KaiserWindow(int width, double shape) : width_(width), shape_(shape) {}

  double at(double s) const;
  /// int at(s) exp(-i xi s) ds
  double transform(double xi) const;

  int lanes() const { return width_ <= 8 ? 8 : 16; }
  /// Its polynomials as GridWindow wants them.
  template <typename Real>
  std::vector<Real> polynomials() const;

 private:
  int width_;
  double shape_;
};

/// Points of a grid along each axis, x, y and z.
using GridAxes = std::array<int, 3>;

/// A period that shows no image of the body.
///
/// extent   of the body along each axis [m]
/// points   of the grid that is multiplied: the period is at least as long
GridAxes grid_period(const GridSpec& spec, const Vector3& extent, const GridAxes& points);

/// What the transform of a period is multiplied by: the spectrum of the smooth part over that of w * w and over the
/// points of the period. Along each axis it has half the period and its end, z side by side.
std::vector<Complex> grid_symbol(const KernelSplit& kernel, const GridSpec& spec, const Vector3& extent,
                                 const GridAxes& period);

/// The smooth part of a kernel between all points of a grid, for faces that meet the grid by a window w:
///
///   grid_i <- sum over j of L(x_i - x_j) grid_j,   with the spectrum of L that of the smooth part over that of w * w
///
/// Axes are doubled so that no image of the body is seen, and the kernel is continued smoothly beyond the body. What
/// is zero, or not asked for, is not transformed.
template <typename Real>
class GridConvolution {
 public:
  /// extent   of the body along each axis [m]
  GridConvolution(const KernelSplit& kernel, const GridSpec& spec, const Vector3& extent);

  /// The grid that is multiplied, w points along each axis more than the body's extent. One product at a time.
  GridView<Real> grid();
  void clear();
  void multiply();

 private:
  void make_symbol(const KernelSplit& kernel, const GridSpec& spec, const Vector3& extent);
  void multiply_plane(int x, Real* columns, Real* rows, Real* work);
  std::ptrdiff_t plane() const { return static_cast<std::ptrdiff_t>(points_[1]) * points_[2]; }

  GridAxes points_;  // of the grid; along z whole rows of lanes
  GridAxes period_;
  std::vector<LineTransform<Real>> lines_;   // one an axis
  std::ptrdiff_t symbol_row_;                // the period along y in whole rows of lanes
  std::vector<Real> symbol_re_, symbol_im_;  // x and z to half the period, y all along it
  std::vector<Real> re_, im_;                // the grid
  std::vector<Real> planes_re_, planes_im_;  // transformed along x
};

extern template class GridConvolution<float>;
extern template class GridConvolution<double>;

}  // namespace touchfield
