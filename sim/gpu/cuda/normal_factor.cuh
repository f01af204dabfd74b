#pragma once

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

/// The Cholesky factor A = L L^T of a real positive definite matrix, for many solutions one after another: with L^-1
/// beside it, a solution is two products, where substitution would wait for each entry. Real is float or double.
template <typename Real>
class NormalFactor {
 public:
  explicit NormalFactor(Context& context) : context_(context) {}

  int size() const { return size_; }
  /// Where the lower triangle of the next A goes, n x n; nothing else is read.
  Real* matrix(int size);
  /// returns   false where a pivot is not positive or not finite
  bool factorise();
  /// A^-1 right / unit, on the card until the next call.
  ///
  /// right   on the card
  const Real* solve(const double* right, double unit);

 private:
  void invert();

  Context& context_;
  int size_ = 0;
  Array<Real> matrix_{context_};   // A, then L in the lower triangle
  Array<Real> inverse_{context_};  // L^-1, zeros above
  Array<Real> between_{context_};
  Array<Real> work_{context_};
  Array<int> info_{context_};
  Array<Real> right_{context_};
  Array<Real> half_{context_};
  Array<Real> solution_{context_};
};

}  // namespace touchfield::cuda
