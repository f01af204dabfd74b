#pragma once

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

/// How single precision multiplies: as it is (24 bits), or on the tensor cores with factors rounded to 11 bits (TF32;
/// on cards without them as it is). Sums are in single precision.
enum class Arithmetic { kSingle, kTf32 };

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

}  // namespace touchfield::cuda
