#include "sim/gpu/cuda/dense.cuh"
#include "sim/gpu/cuda/products.cuh"

namespace touchfield::cuda {

namespace {

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

}  // namespace touchfield::cuda
