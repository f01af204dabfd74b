#include <algorithm>
#include <cmath>

#include "sim/gpu/cuda/column_sums.cuh"
#include "sim/gpu/cuda/lu.cuh"

namespace touchfield::cuda {

Lu::Lu(Context& context)
    : context_(context), pivots_(context), info_(context, 1), work_(context), sums_(context), column_(context) {}

void Lu::factorise(int n, cuComplex* a) {
  n_ = n;
  factors_ = a;
  norm_ = 0.0;
  if (n == 0) {
    return;
  }
  norm_ = greatest_column_sum(context_, n, a, false, sums_);
  if (!std::isfinite(norm_)) {
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

/// v <- op(A)^-1 v; returns its 1-norm.
double Lu::solve_column(cublasOperation_t op, std::vector<std::complex<float>>& v) {
  column_.upload(reinterpret_cast<const cuComplex*>(v.data()), v.size());
  solve(op, 1, column_.data());
  column_.download(reinterpret_cast<cuComplex*>(v.data()), v.size());
  double sum = 0.0;
  for (const std::complex<float>& value : v) {
    sum += std::abs(value);
  }
  return sum;
}

double Lu::reciprocal_condition() {
  if (n_ == 0) {
    return 1.0;
  }
  constexpr int kMostRounds = 5;
  const std::size_t n = static_cast<std::size_t>(n_);
  std::vector<std::complex<float>> v(n, 1.0F / static_cast<float>(n_));
  double inverse_norm = solve_column(CUBLAS_OP_N, v);
  std::size_t at = n;  // the unit vector that the estimate is of; none yet
  for (int round = 0; n > 1 && round < kMostRounds; ++round) {
    for (std::complex<float>& value : v) {
      const float size = std::abs(value);
      value = size > 0.0F ? value / size : std::complex<float>(1.0F);
    }
    solve_column(CUBLAS_OP_C, v);
    const auto greatest = std::max_element(
        v.begin(), v.end(), [](const auto& one, const auto& other) { return std::norm(one) < std::norm(other); });
    const auto next = static_cast<std::size_t>(greatest - v.begin());
    if (at < n && std::abs(v[at]) >= std::abs(*greatest)) {
      break;
    }
    at = next;
    v.assign(n, 0.0F);
    v[at] = 1.0F;
    const double found = solve_column(CUBLAS_OP_N, v);
    if (!(found > inverse_norm)) {
      break;
    }
    inverse_norm = found;
  }
  if (n > 1) {  // against matrices that the search is blind to
    for (std::size_t i = 0; i < n; ++i) {
      const double size = 1.0 + static_cast<double>(i) / static_cast<double>(n - 1);
      v[i] = static_cast<float>(i % 2 == 0 ? size : -size);
    }
    inverse_norm = std::max(inverse_norm, 2.0 * solve_column(CUBLAS_OP_N, v) / (3.0 * static_cast<double>(n)));
  }
  return norm_ > 0.0 && inverse_norm > 0.0 ? 1.0 / (norm_ * inverse_norm) : 0.0;
}

}  // namespace touchfield::cuda
