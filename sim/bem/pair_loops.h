#pragma once

namespace touchfield {

/// Loops over pairs of points, compiled for several instruction levels and chosen when the program runs.

/// What a pair of points adds to a sum over faces. Lengths are in half wavelengths, so that k r = pi u.
enum class Layer {
  kSingle,         // S   g
  kDouble,         // D   dg/dn_y, n the normal at the source y
  kAdjoint,        // D'  dg/dn_x, m the normal at the point x
  kBurtonMiller,   // D + i gamma W, W = d2g/dn_x dn_y
  kAdjointMiller,  // D' + i gamma W, the transpose of the above
  kSingleAdjoint,  // S + i gamma D'
};

/// Wavenumber, damping and coupling in the same units.
template <typename Real>
struct PairConstants {
  Real damping = 0;  // alpha / k times pi: damping of the amplitude a half wavelength
  Real gamma = 0;    // coupling times k / pi: eta = i gamma
};

/// A point with its unit normal; the normal is not read by kSingle and kDouble.
template <typename Real>
struct PairPoint {
  Real x, y, z, nx, ny, nz;
};

/// Points as one array a quantity.
template <typename Real>
struct PairSources {
  const Real *x, *y, *z, *nx, *ny, *nz;
};

/// Values and sums of one point and its sources, for S right-hand sides. Those of the sources are kept one column per
/// right-hand side, `stride` apart.
template <typename Real>
struct MutualSums {
  const Real *source_re, *source_im;  // values of the sources
  const Real *point_re, *point_im;    // S values of the point
  Real *source_sum_re, *source_sum_im;
  Real *point_sum_re, *point_sum_im;  // S sums
  int stride;
  int right_hand_sides;
};

/// Products of the parts of two rows of complex numbers, summed: their inner product is (rr - ii) + i (ri + ir).
template <typename Real>
struct PairProducts {
  Real rr = 0, ii = 0, ri = 0, ir = 0;
};

inline constexpr int kPairBlock = 256;  // most sources of add_mutual

/// The loops in one precision as compiled for one instruction level.
template <typename Real>
struct PairLoopTableOf {
  /// The kernel times 4 pi between one point and `count` sources, in units of half wavelengths; 0 where they coincide.
  ///
  /// Real       float: 3e-7 (1 + k r) relative; double: 1e-15 (1 + k r)
  /// re, im     `count` values each
  void (*values)(Layer layer, const PairConstants<Real>& constants, const PairPoint<Real>& point,
                 const PairSources<Real>& sources, int count, Real* re, Real* im);

  /// Sums over pairs in both directions at once: with K of kDouble or kBurtonMiller (transposed: K(x, y) and K(y, x)
  /// change places)
  ///
  ///   point_sum_s  = sum over j of K(point, source_j) source_value_js
  ///   source_sum_js += K(source_j, point) point_value_s
  ///
  /// count   <= kPairBlock
  void (*add_mutual)(Layer layer, bool transposed, const PairConstants<Real>& constants, const PairPoint<Real>& point,
                     const PairSources<Real>& sources, int count, const MutualSums<Real>& sums);

  PairProducts<Real> (*products)(const Real* a_re, const Real* a_im, const Real* b_re, const Real* b_im, int count);
};

/// All loops of one level: pair_loops_level.cpp makes one table a level.
struct PairLoopTable {
  PairLoopTableOf<float> of_float;
  PairLoopTableOf<double> of_double;

  /// The kernel of kDouble, kAdjoint, kBurtonMiller or kAdjointMiller at k = 0, in the same units.
  void (*static_values)(Layer layer, double gamma, const PairPoint<double>& point, const PairSources<double>& sources,
                        int count, double* re, double* im);

  /// sum of weight_j n_j.(x - y_j) / r^3 over the sources, the static double layer; sources at x itself add 0.
  double (*static_sum)(const PairPoint<double>& point, const PairSources<double>& sources, const double* weight,
                       int count);

  /// Which sources lie nearer to the point than reach_j: writes their numbers, ascending, to `near` (room for all) and
  /// returns how many.
  int (*near_sources)(const PairPoint<double>& point, const PairSources<double>& sources, const double* reach_squared,
                      int count, int* near);
};

namespace generic {
extern const PairLoopTable kPairLoops;
}  // namespace generic
namespace v2 {
extern const PairLoopTable kPairLoops;
}  // namespace v2
namespace v3 {
extern const PairLoopTable kPairLoops;
}  // namespace v3
namespace v4 {
extern const PairLoopTable kPairLoops;
}  // namespace v4

enum class InstructionLevel;  // its header brings inline functions, which level files must not hold

/// The loops of one level, which the processor must carry out.
const PairLoopTable& pair_loops(InstructionLevel level);

/// Those for the processor at hand, and of them those in one precision.
const PairLoopTable& pair_loops();
template <typename Real>
const PairLoopTableOf<Real>& pair_loops_of();

}  // namespace touchfield
