#include "sim/gpu/cuda/column_sums.cuh"
#include "sim/gpu/cuda/hermitian.cuh"

namespace touchfield::cuda {

void HermitianSolver::solve(int n, cuDoubleComplex* a, double* values) {
  if (n == 0) {
    return;
  }
  if (!std::isfinite(greatest_column_sum(context_, n, a, true, sums_))) {
    throw std::domain_error("hermitian_eigen: the matrix holds a value that is not finite");
  }
  std::size_t on_card = 0;
  std::size_t on_host = 0;
  check(cusolverDnXsyevd_bufferSize(context_.solver(), context_.solver_params(), CUSOLVER_EIG_MODE_VECTOR,
                                    CUBLAS_FILL_MODE_LOWER, n, CUDA_C_64F, a, n, CUDA_R_64F, values, CUDA_C_64F,
                                    &on_card, &on_host),
        "eigenvalues");
  work_.resize(on_card);
  host_work_.resize(on_host);
  check(cusolverDnXsyevd(context_.solver(), context_.solver_params(), CUSOLVER_EIG_MODE_VECTOR, CUBLAS_FILL_MODE_LOWER,
                         n, CUDA_C_64F, a, n, CUDA_R_64F, values, CUDA_C_64F, work_.data(), on_card, host_work_.data(),
                         on_host, info_.data()),
        "eigenvalues");
  auto* info = static_cast<int*>(context_.staging(sizeof(int)));
  info_.download(info, 1);
  if (*info != 0) {
    throw std::domain_error("hermitian_eigen: the iteration did not converge");
  }
}

}  // namespace touchfield::cuda
