#pragma once

#include <cstdint>
#include <vector>

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

/// What cuSOLVER works with, kept from one dense matrix to the next.
struct DenseWork {
  Context& context;
  Array<int> info{context, 1};
  Array<char> on_card{context};
  std::vector<char> on_host{};
};

/// LU factorisation with partial pivoting of a dense matrix in single precision (cuSOLVER getrf), as
/// touchfield::DenseLuSingle (solvers/linear/dense_lu.h).
class Lu {
 public:
  explicit Lu(Context& context) : work_{context}, pivots_(context) {}

  /// a        n x n on the card, n > 0, column by column; overwritten by its factors, and used by what follows
  /// throws   std::domain_error if the matrix is exactly singular or holds a value that is not finite
  void factorise(int n, cuComplex* a);

  /// b <- A^-1 b (CUBLAS_OP_N), A^-T b without conjugation (CUBLAS_OP_T) or A^-H b (CUBLAS_OP_C); b is n x columns.
  void solve(cublasOperation_t op, int columns, cuComplex* b);

 private:
  DenseWork work_;
  int n_ = 0;
  cuComplex* factors_ = nullptr;
  Array<std::int64_t> pivots_;
};

/// All eigenvalues and eigenvectors of Hermitian matrices in double precision (cuSOLVER syevd), as
/// touchfield::hermitian_eigen (solvers/linear/hermitian_eigen.h).
class HermitianSolver {
 public:
  explicit HermitianSolver(Context& context) : work_{context} {}

  /// A = V diag(values) V^H.
  ///
  /// a        n x n on the card, n > 0, column by column; V overwrites it
  /// values   n on the card, ascending
  /// throws   std::domain_error if it holds a value that is not finite or the iteration fails
  void solve(int n, cuDoubleComplex* a, double* values);

 private:
  DenseWork work_;
};

}  // namespace touchfield::cuda
