#pragma once

#include "sim/gpu/cuda/boundary.cuh"
#include "sim/gpu/cuda/coarse_space.cuh"
#include "sim/gpu/cuda/products.cuh"
#include "sim/gpu/cuda/surface_filter.cuh"

namespace touchfield::cuda {

/// The right preconditioner of Burton and Miller's B, as touchfield::TwoLevel (sim/bem/two_level.h):
///
///   M = P E^-1 R + f(L) (1 - P R),   E = B[points, :] P,   R = (P^T A P)^-1 P^T A
///
/// All of it is made on the card; E^-1 and the inverse of the mass P^T A P are stored.
///
/// memory   16 bytes per pair of points, some 64 per face, and a panel of rows of B while it is made
class TwoLevel {
 public:
  static constexpr int kMostPoints = 12'000;

  /// boundary   of Burton and Miller; not used any more afterwards
  /// faces      outlive this; where they move, it stays that of the body before
  /// throws     std::domain_error if E or the mass is singular, or where it takes too many points, or too few
  TwoLevel(const Faces& faces, const Boundary& boundary, double coupling);

  int points() const { return coarse_.size(); }

  /// y = M x, or M^T x; M x columns, not the same.
  void apply(bool transposed, const cuComplex* x, int columns, cuComplex* y);

 private:
  void invert(Array<cuComplex>& matrix, Array<cuComplex>& inverse);
  void solve(const Array<cuComplex>& inverse, cublasOperation_t op, const cuComplex* c, int columns, cuComplex* out);

  const Faces& faces_;
  Context& context_;
  CoarseSpace coarse_;
  SurfaceFilter filter_;
  Array<cuComplex> coarse_inverse_{context_}, mass_inverse_{context_};
  Array<cuComplex> first_{context_}, second_{context_}, rest_{context_};  // of points; of faces
};

}  // namespace touchfield::cuda
