#pragma once

#include <cstdint>
#include <vector>

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

/// How single precision multiplies: as it is (24 bits), or on the tensor cores with factors rounded to 11 bits (TF32;
/// on cards without them as it is). Sums are in single precision.
enum class Arithmetic { kSingle, kTf32 };

constexpr cuComplex kOne = {1.0F, 0.0F};
constexpr cuComplex kZero = {0.0F, 0.0F};
constexpr cuComplex kMinusOne = {-1.0F, 0.0F};

/// C = alpha op(A) op(B) + beta C, op(A) m x k, op(B) k x n; ld: rows of the arrays as they lie.
void multiply(Context& context, cublasOperation_t op_a, cublasOperation_t op_b, int m, int n, int k, cuComplex alpha,
              const cuComplex* a, int lda, const cuComplex* b, int ldb, cuComplex beta, cuComplex* c, int ldc,
              Arithmetic arithmetic);
void multiply(Context& context, cublasOperation_t op_a, cublasOperation_t op_b, int m, int n, int k,
              cuDoubleComplex alpha, const cuDoubleComplex* a, int lda, const cuDoubleComplex* b, int ldb,
              cuDoubleComplex beta, cuDoubleComplex* c, int ldc);

/// C = A^H A, all of it; A rows x columns, C columns x columns, in single precision.
void gram(Context& context, int rows, int columns, const cuComplex* a, int lda, cuComplex* c, int ldc);

/// y += factor x
void add(Context& context, cuComplex factor, const cuComplex* x, cuComplex* y, std::size_t count);
void add(Context& context, cuDoubleComplex factor, const cuDoubleComplex* x, cuDoubleComplex* y, std::size_t count);

/// Whether every value is finite: their sum of magnitudes is.
bool all_finite(Context& context, const cuComplex* a, std::size_t count);
bool all_finite(Context& context, const cuDoubleComplex* a, std::size_t count);

/// Between precisions: cuComplex and cuDoubleComplex.
template <typename From, typename To>
void convert(Context& context, const From* from, To* to, std::size_t count);

/// What cuSOLVER works with, kept from one dense matrix to the next.
struct DenseWork {
  Context& context;
  Array<int> info{context, 1};
  Array<char> on_card{context};
  std::vector<char> on_host{};
};

/// LU factorisation with partial pivoting of a dense matrix in single precision (cuSOLVER getrf), as
/// touchfield::DenseLuSingle (solvers/linear/factorisations.h).
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

/// Eigenvectors or Cholesky factors of Hermitian matrices in double precision; the former (cuSOLVER syevd) as
/// touchfield::hermitian_eigen (solvers/linear/factorisations.h).
class HermitianSolver {
 public:
  explicit HermitianSolver(Context& context) : work_{context} {}

  /// A = V diag(values) V^H.
  ///
  /// a        n x n on the card, n > 0, column by column; V overwrites it
  /// values   n on the card, ascending
  /// throws   std::domain_error if it holds a value that is not finite or the iteration fails
  void solve(int n, cuDoubleComplex* a, double* values);

  /// A = L L^H, L in the lower triangle (cuSOLVER potrf). False where A is not positive definite; it is lost then.
  bool factorise(int n, cuDoubleComplex* a);

 private:
  DenseWork work_;
};

}  // namespace touchfield::cuda
