#pragma once

#include <vector>

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

/// All eigenvalues and eigenvectors of Hermitian matrices in double precision (cuSOLVER syevd), as
/// touchfield::hermitian_eigen (solvers/linear/hermitian_eigen.h). What it takes of the card is kept for the next one.
class HermitianSolver {
 public:
  explicit HermitianSolver(Context& context) : context_(context) {}

  /// A = V diag(values) V^H.
  ///
  /// a        n x n on the card, column by column; only its lower triangle is read, and V overwrites it
  /// values   n on the card, ascending
  /// throws   std::domain_error if it holds a value that is not finite or the iteration fails
  void solve(int n, cuDoubleComplex* a, double* values);

 private:
  Context& context_;
  Array<int> info_{context_, 1};
  Array<char> work_{context_};
  std::vector<char> host_work_;
  Array<double> sums_{context_};
};

}  // namespace touchfield::cuda
