#include <cmath>

#include "sim/gpu/cuda/column_sums.cuh"
#include "sim/gpu/cuda/lu.cuh"

namespace touchfield::cuda {

Lu::Lu(Context& context) : context_(context), pivots_(context), info_(context, 1), work_(context), sums_(context) {}

void Lu::factorise(int n, cuComplex* a) {
  n_ = n;
  factors_ = a;
  if (n == 0) {
    return;
  }
  if (!std::isfinite(greatest_column_sum(context_, n, a, false, sums_))) {
    throw std::domain_error("the matrix holds a value that is not finite");
  }
  std::size_t on_card = 0;
  std::size_t on_host = 0;
  check(cusolverDnXgetrf_bufferSize(context_.solver(), context_.solver_params(), n, n, CUDA_C_32F, a, n, CUDA_C_32F,
                                    &on_card, &on_host),
        "LU");
  pivots_.resize(static_cast<std::size_t>(n));
  work_.resize(on_card);
  host_work_.resize(on_host);
  check(cusolverDnXgetrf(context_.solver(), context_.solver_params(), n, n, CUDA_C_32F, a, n, pivots_.data(),
                         CUDA_C_32F, work_.data(), on_card, host_work_.data(), on_host, info_.data()),
        "LU");
  auto* info = static_cast<int*>(context_.staging(sizeof(int)));
  info_.download(info, 1);
  if (*info > 0) {
    throw std::domain_error("the matrix is singular: pivot " + std::to_string(*info) + " is zero");
  }
}

void Lu::solve(cublasOperation_t op, int columns, cuComplex* b) {
  if (n_ > 0 && columns > 0) {
    check(cusolverDnXgetrs(context_.solver(), context_.solver_params(), op, n_, columns, CUDA_C_32F, factors_, n_,
                           pivots_.data(), CUDA_C_32F, b, n_, info_.data()),
          "solution by LU");
  }
}

}  // namespace touchfield::cuda
