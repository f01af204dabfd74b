#pragma once

#include <vector>

#include "sim/gpu/cuda/faces.cuh"

namespace touchfield::cuda {

/// f(L) and its transpose, as touchfield::SurfaceFilter (sim/bem/surface_filter.h), in single precision.
class SurfaceFilter {
 public:
  /// faces   outlive this; where they move, another is made
  /// coupling   c > 0
  SurfaceFilter(const Faces& faces, double coupling);

  int degree() const { return static_cast<int>(coefficients_.size()) - 1; }

  /// y = f(L) x, or f(L)^T x; M x columns, not the same.
  void apply(bool transposed, const cuComplex* x, int columns, cuComplex* y);

 private:
  void find_neighbours();

  const Faces& faces_;
  Context& context_;
  Array<int> neighbour_{context_};                 // 3 M, by corners: the same edge of the other face; -1: none
  Array<float> weight_{context_}, own_{context_};  // of 2 L / largest - 1: 3 M of neighbours, M of the faces themselves
  std::vector<cuComplex> coefficients_;
  Array<cuComplex> before_{context_}, now_{context_};
};

}  // namespace touchfield::cuda
