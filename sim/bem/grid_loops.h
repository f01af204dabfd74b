#pragma once

#include <cstddef>

#include "sim/bem/pair_loops.h"

namespace touchfield {

/// The inner loops of sums over faces by a grid (grid_sum.h), compiled for several instruction levels and chosen when
/// the program runs.

/// Lines that are transformed together, and the multiple that rows of a grid are padded to: a cache line of numbers.
template <typename Real>
inline constexpr int kGridLanes = 64 / static_cast<int>(sizeof(Real));

inline constexpr int kWindowDegree = 16;  // of the polynomials a window is made of
inline constexpr int kWidestWindow = 16;  // points along an axis

/// A window along one axis as polynomials in t = 2 f - 1, where f in 0..1 is the place between two points. Coefficient
/// c of the weight of point l is values[c * lanes + l], the highest power first. Points from `width` on weigh 0.
template <typename Real>
struct GridWindow {
  int width;
  int lanes;  // 8 or 16
  const Real* values;
};

/// Faces on a grid, one array per quantity. `first` is the first grid point that a face's window reaches. fx, fy and fz
/// are its place after that point along each axis. nx, ny and nz are its unit normal over the grid's step.
template <typename Real>
struct GridFaces {
  const std::ptrdiff_t* first;
  const Real *fx, *fy, *fz;
  const Real *nx, *ny, *nz;
};

/// A grid of complex numbers; along z they lie side by side.
template <typename Real>
struct GridView {
  Real *re, *im;
  std::ptrdiff_t x_stride, y_stride;
};

/// Strengths or values of faces: of charges, and of dipoles or slopes along their normals. A null pointer: none.
template <typename Real>
struct FaceValues {
  Real *charge_re, *charge_im, *dipole_re, *dipole_im;
};

template <typename Real>
inline constexpr int kLocalDegree = sizeof(Real) == 4 ? 12 : 24;  // of the polynomials of the local kernel

/// The local kernel times 4 pi in units of its reach, u = r below 1 (grid_spec.h). Its parts are polynomials in
/// t = 2 u - 1, the lowest power first. v is that of g, a of its slope and b of its second derivative:
///
///   S = v/u   D = a (n.d)/u^3   D' = -a (m.d)/u^3   W = (a m.n - b (m.d)(n.d)/u^2)/u^3,   d = x - y
template <typename Real>
struct LocalKernel {
  struct Part {
    Real v[kLocalDegree<Real> + 1], a[kLocalDegree<Real> + 1], b[kLocalDegree<Real> + 1];
    Real s0, w0;  // S and W / m.n where the points coincide, so that smooth and local part cancel
  };
  Part re, im;  // v, a and b are real if the wavenumber is
  bool damped;
  Real gamma;  // eta = i gamma
};

/// One stage after another of a discrete Fourier transform of n points, n a product of the radices.
template <typename Real>
struct LinePlan {
  int n;
  int stages;
  const int* radix;       // of each: 2, 3, 4 or 5
  const Real *cos, *sin;  // of 2 pi j / n, j = 0 .. n - 1
};

/// The loops in one precision as compiled for one instruction level.
template <typename Real>
struct GridLoopTableOf {
  /// X_m = sum over j of x_j exp(-2 pi i j m / n) of kGridLanes lines at once: number j of line l is [j kGridLanes +
  /// l]. With re and im exchanged in both, the sign of the exponent is the other. `work` has room for as many numbers;
  /// the result is written to re and im.
  void (*transform)(const LinePlan<Real>& plan, Real* re, Real* im, Real* work_re, Real* work_im);

  /// grid_i += sum over the faces first <= f < last of charge_f w(i - x_f) + dipole_f n_f . grad_x w(i - x_f), w the
  /// product of the windows along the axes.
  void (*spread)(const GridWindow<Real>& window, const GridFaces<Real>& faces, const FaceValues<Real>& values,
                 int first, int last, const GridView<Real>& grid);

  /// The transpose: charge_f = sum over i of w(i - x_f) grid_i, dipole_f the same of its slope.
  void (*interpolate)(const GridWindow<Real>& window, const GridFaces<Real>& faces, const FaceValues<Real>& values,
                      int first, int last, const GridView<Real>& grid);

  /// sum_s = sum over j of K(point, source_j) value_js, K the local kernel of a layer.
  ///
  /// value_re, value_im   the value of source j and column s is [s stride + j]
  void (*local)(Layer layer, const LocalKernel<Real>& kernel, const PairPoint<Real>& point,
                const PairSources<Real>& sources, int count, const Real* value_re, const Real* value_im, int stride,
                int columns, Real* sum_re, Real* sum_im);
};

/// All loops of one level: grid_loops_level.cpp makes one table a level.
struct GridLoopTable {
  GridLoopTableOf<float> of_float;
  GridLoopTableOf<double> of_double;
};

namespace generic {
extern const GridLoopTable kGridLoops;
}  // namespace generic
namespace v2 {
extern const GridLoopTable kGridLoops;
}  // namespace v2
namespace v3 {
extern const GridLoopTable kGridLoops;
}  // namespace v3
namespace v4 {
extern const GridLoopTable kGridLoops;
}  // namespace v4

/// The loops of one level, which the processor must carry out.
const GridLoopTable& grid_loops(InstructionLevel level);

/// Those for the processor at hand in one precision.
template <typename Real>
const GridLoopTableOf<Real>& grid_loops_of();

}  // namespace touchfield
