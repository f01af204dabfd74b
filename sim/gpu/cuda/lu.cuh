#pragma once

#include <cstdint>
#include <vector>

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

/// LU factorisation with partial pivoting of a dense matrix in single precision (cuSOLVER getrf), as
/// touchfield::DenseLuSingle (solvers/linear/dense_lu.h). What it takes of the card is kept for the next matrix.
class Lu {
 public:
  explicit Lu(Context& context);

  /// a        n x n on the card, column by column; overwritten by its factors, and used by what follows
  /// throws   std::domain_error if the matrix is exactly singular or holds a value that is not finite
  void factorise(int n, cuComplex* a);

  /// b <- A^-1 b (CUBLAS_OP_N), A^-T b without conjugation (CUBLAS_OP_T) or A^-H b (CUBLAS_OP_C); b is n x columns.
  void solve(cublasOperation_t op, int columns, cuComplex* b);

 private:
  Context& context_;
  int n_ = 0;
  cuComplex* factors_ = nullptr;
  Array<std::int64_t> pivots_;
  Array<int> info_;
  Array<char> work_;
  std::vector<char> host_work_;
  Array<double> sums_;
};

}  // namespace touchfield::cuda
