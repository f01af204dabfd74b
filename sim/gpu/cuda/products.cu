#include <cmath>

#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/products.cuh"

namespace touchfield::cuda {

namespace {

constexpr unsigned kThreads = 256;

template <typename From, typename To>
__global__ void convert_values(const From* from, To* to, std::size_t count) {
  const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
  if (i < count) {
    to[i] = {static_cast<decltype(to->x)>(from[i].x), static_cast<decltype(to->x)>(from[i].y)};
  }
}

/// The upper triangle of a Hermitian matrix from its lower one.
__global__ void mirror_lower(int size, cuComplex* matrix, int ld) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const int j = static_cast<int>(blockIdx.y * blockDim.y + threadIdx.y);
  if (i < size && j < i) {
    matrix[j + std::size_t{1} * i * ld] = cuConjf(matrix[i + std::size_t{1} * j * ld]);
  }
}

/// By a routine of cuSOLVER's, given as a query of how much room it needs and itself; what it says in info.
template <class Query, class Routine>
int carry_out(DenseWork& work, const char* what, const Query& query, const Routine& routine) {
  std::size_t on_card = 0;
  std::size_t on_host = 0;
  check(query(&on_card, &on_host), what);
  work.on_card.resize(on_card);
  work.on_host.resize(on_host);
  check(routine(work.on_card.data(), on_card, work.on_host.data(), on_host, work.info.data()), what);
  return work.info.value(0);
}

}  // namespace

void multiply(Context& context, cublasOperation_t op_a, cublasOperation_t op_b, int m, int n, int k, cuComplex alpha,
              const cuComplex* a, int lda, const cuComplex* b, int ldb, cuComplex beta, cuComplex* c, int ldc,
              Arithmetic arithmetic) {
  if (n == 0) {
    return;
  }
  const bool tf32 = arithmetic == Arithmetic::kTf32 && context.has_tf32();
  check(cublasGemmEx(context.blas(), op_a, op_b, m, n, k, &alpha, a, CUDA_C_32F, lda, b, CUDA_C_32F, ldb, &beta, c,
                     CUDA_C_32F, ldc, tf32 ? CUBLAS_COMPUTE_32F_FAST_TF32 : CUBLAS_COMPUTE_32F, CUBLAS_GEMM_DEFAULT),
        "product");
}

void multiply(Context& context, cublasOperation_t op_a, cublasOperation_t op_b, int m, int n, int k,
              cuDoubleComplex alpha, const cuDoubleComplex* a, int lda, const cuDoubleComplex* b, int ldb,
              cuDoubleComplex beta, cuDoubleComplex* c, int ldc) {
  check(cublasZgemm(context.blas(), op_a, op_b, m, n, k, &alpha, a, lda, b, ldb, &beta, c, ldc), "product");
}

void gram(Context& context, int rows, int columns, const cuComplex* a, int lda, cuComplex* c, int ldc) {
  const float one = 1.0F, zero = 0.0F;
  check(cublasCherk(context.blas(), CUBLAS_FILL_MODE_LOWER, CUBLAS_OP_C, columns, rows, &one, a, lda, &zero, c, ldc),
        "Gram matrix");
  const dim3 threads(32, 8);
  const dim3 blocks(blocks_for(columns, threads.x), blocks_for(columns, threads.y));
  launch(context, "Gram matrix", mirror_lower, blocks, threads, columns, c, ldc);
}

void add(Context& context, cuComplex factor, const cuComplex* x, cuComplex* y, std::size_t count) {
  check(cublasCaxpy_64(context.blas(), static_cast<std::int64_t>(count), &factor, x, 1, y, 1), "sum");
}

void add(Context& context, cuDoubleComplex factor, const cuDoubleComplex* x, cuDoubleComplex* y, std::size_t count) {
  check(cublasZaxpy_64(context.blas(), static_cast<std::int64_t>(count), &factor, x, 1, y, 1), "sum");
}

bool all_finite(Context& context, const cuComplex* a, std::size_t count) {
  float sum = 0.0F;
  check(cublasScasum_64(context.blas(), static_cast<std::int64_t>(count), a, 1, &sum), "sum of magnitudes");
  return std::isfinite(sum);
}

bool all_finite(Context& context, const cuDoubleComplex* a, std::size_t count) {
  double sum = 0.0;
  check(cublasDzasum_64(context.blas(), static_cast<std::int64_t>(count), a, 1, &sum), "sum of magnitudes");
  return std::isfinite(sum);
}

template <typename From, typename To>
void convert(Context& context, const From* from, To* to, std::size_t count) {
  launch(context, "convert", convert_values<From, To>, blocks_for(count, kThreads), kThreads, from, to, count);
}
template void convert(Context&, const cuDoubleComplex*, cuComplex*, std::size_t);
template void convert(Context&, const cuComplex*, cuDoubleComplex*, std::size_t);

void Lu::factorise(int n, cuComplex* a) {
  n_ = n;
  factors_ = a;
  Context& on = work_.context;
  if (!all_finite(on, a, std::size_t{1} * n * n)) {
    throw std::domain_error("the matrix holds a value that is not finite");
  }
  pivots_.resize(static_cast<std::size_t>(n));
  const auto routine = [&](auto... room) {
    return cusolverDnXgetrf(on.solver(), on.solver_params(), n, n, CUDA_C_32F, a, n, pivots_.data(), CUDA_C_32F,
                            room...);
  };
  const auto query = [&](auto... sizes) {
    return cusolverDnXgetrf_bufferSize(on.solver(), on.solver_params(), n, n, CUDA_C_32F, a, n, CUDA_C_32F, sizes...);
  };
  if (const int pivot = carry_out(work_, "LU", query, routine); pivot > 0) {
    throw std::domain_error("the matrix is singular: pivot " + std::to_string(pivot) + " is zero");
  }
}

void Lu::solve(cublasOperation_t op, int columns, cuComplex* b) {
  if (n_ > 0 && columns > 0) {
    check(cusolverDnXgetrs(work_.context.solver(), work_.context.solver_params(), op, n_, columns, CUDA_C_32F, factors_,
                           n_, pivots_.data(), CUDA_C_32F, b, n_, work_.info.data()),
          "solution by LU");
  }
}

void HermitianSolver::solve(int n, cuDoubleComplex* a, double* values) {
  Context& on = work_.context;
  if (!all_finite(on, a, std::size_t{1} * n * n)) {
    throw std::domain_error("hermitian_eigen: the matrix holds a value that is not finite");
  }
  const auto with = [&](auto function, auto... room) {
    return function(on.solver(), on.solver_params(), CUSOLVER_EIG_MODE_VECTOR, CUBLAS_FILL_MODE_LOWER, n, CUDA_C_64F, a,
                    n, CUDA_R_64F, values, CUDA_C_64F, room...);
  };
  const auto query = [&](auto... sizes) { return with(cusolverDnXsyevd_bufferSize, sizes...); };
  const auto routine = [&](auto... room) { return with(cusolverDnXsyevd, room...); };
  if (carry_out(work_, "eigenvalues", query, routine) != 0) {
    throw std::domain_error("hermitian_eigen: the iteration did not converge");
  }
}

bool HermitianSolver::factorise(int n, cuDoubleComplex* a) {
  Context& on = work_.context;
  const auto with = [&](auto function, auto... room) {
    return function(on.solver(), on.solver_params(), CUBLAS_FILL_MODE_LOWER, n, CUDA_C_64F, a, n, CUDA_C_64F, room...);
  };
  const auto query = [&](auto... sizes) { return with(cusolverDnXpotrf_bufferSize, sizes...); };
  const auto routine = [&](auto... room) { return with(cusolverDnXpotrf, room...); };
  return carry_out(work_, "Cholesky factor", query, routine) == 0;
}

}  // namespace touchfield::cuda
