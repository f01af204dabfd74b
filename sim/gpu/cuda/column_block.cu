#include <cmath>

#include "sim/gpu/cuda/block_sum.cuh"
#include "sim/gpu/cuda/column_block.cuh"

namespace touchfield::cuda {

namespace {

__global__ void __launch_bounds__(kColumnThreads) find_norms(int n, const cuComplex* b, ColumnStatus* status) {
  const cuComplex* own = b + std::size_t{blockIdx.x} * n;
  double sum = 0.0;
  for (int row = static_cast<int>(threadIdx.x); row < n; row += kColumnThreads) {
    sum += square(own[row]);
  }
  sum = block_sum(sum);
  if (threadIdx.x == 0) {
    status[blockIdx.x] = {sqrt(sum), 0, 0};
  }
}

__global__ void __launch_bounds__(kColumnThreads) move_columns(int n, const Slot* slots, cuComplex* block) {
  const int from = slots[blockIdx.x].from;
  if (from == static_cast<int>(blockIdx.x)) {
    return;
  }
  const cuComplex* old = block + static_cast<std::size_t>(from) * n;
  cuComplex* own = block + std::size_t{blockIdx.x} * n;
  for (int row = static_cast<int>(threadIdx.x); row < n; row += kColumnThreads) {
    own[row] = old[row];
  }
}

/// In place where direction is the product: a thread reads a value before it writes it, and no other does either.
__global__ void __launch_bounds__(kColumnThreads)
    judge_columns(int n, const Slot* slots, const cuComplex* b, const cuComplex* product, const cuComplex* candidate,
                  cuComplex* x, cuComplex* direction, ColumnStatus* status) {
  const Slot slot = slots[blockIdx.x];
  const std::size_t own = std::size_t{blockIdx.x} * n;
  const std::size_t there = static_cast<std::size_t>(slot.column) * n;
  const cuComplex zero = {0.0F, 0.0F};
  double sum = 0.0;
  for (int row = static_cast<int>(threadIdx.x); row < n; row += kColumnThreads) {
    sum += square(cuCsubf(b[there + row], product == nullptr ? zero : product[own + row]));
  }
  const double norm = sqrt(block_sum(sum));
  const double reached = norm / slot.norm;
  if (threadIdx.x == 0) {
    status[blockIdx.x] = {reached, 0, 0};
  }
  if (product != nullptr && !(reached < slot.residual)) {
    return;
  }
  const double factor = norm > 0.0 ? 1.0 / norm : 0.0;
  for (int row = static_cast<int>(threadIdx.x); row < n; row += kColumnThreads) {
    const cuComplex r = cuCsubf(b[there + row], product == nullptr ? zero : product[own + row]);
    direction[own + row] = scaled(r, factor);
    if (product != nullptr) {
      x[there + row] = candidate[own + row];
    }
  }
}

}  // namespace

std::vector<Slot> ColumnBlock::start(const char* who, int n, int columns, const cuComplex* b, cuComplex* x,
                                     bool x_is_start) {
  std::vector<Slot> slots(static_cast<std::size_t>(columns));
  for (int s = 0; s < columns; ++s) {
    slots[static_cast<std::size_t>(s)].column = s;
  }
  const std::size_t rows = static_cast<std::size_t>(n);
  const auto clear = [&](int first, int count) {
    check(cudaMemsetAsync(x + rows * static_cast<std::size_t>(first), 0,
                          rows * static_cast<std::size_t>(count) * sizeof(cuComplex), context_.stream()),
          "set to zero");
  };
  upload(slots);
  find_norms<<<count(), kColumnThreads, 0, context_.stream()>>>(n, b, status());
  context_.launched("norms");
  if (!x_is_start) {
    clear(0, columns);
  }
  const std::vector<ColumnStatus>& norms = wait();
  for (Slot& slot : slots) {
    slot.norm = norms[static_cast<std::size_t>(slot.column)].value;
    if (!std::isfinite(slot.norm)) {
      throw std::domain_error(std::string(who) + ": right-hand side " + std::to_string(slot.column) +
                              " holds a value that is not finite");
    }
    if (x_is_start && !(slot.norm > 0.0)) {
      clear(slot.column, 1);
    }
  }
  drop(slots, [](const Slot& slot) { return !(slot.norm > 0.0); });
  return slots;
}

void ColumnBlock::upload(const std::vector<Slot>& slots) {
  slots_.upload(slots);
  status_.resize(slots.size());
}

const std::vector<ColumnStatus>& ColumnBlock::wait() {
  const std::size_t size = status_.size();
  auto* landed = static_cast<ColumnStatus*>(context_.staging(size * sizeof(ColumnStatus)));
  status_.download(landed, size);
  said_.assign(landed, landed + size);
  return said_;
}

void ColumnBlock::compact(int n, cuComplex* block) {
  move_columns<<<count(), kColumnThreads, 0, context_.stream()>>>(n, slots(), block);
  context_.launched("columns that are left");
}

void ColumnBlock::judge(int n, const cuComplex* b, const cuComplex* product, const cuComplex* candidate, cuComplex* x,
                        cuComplex* direction) {
  judge_columns<<<count(), kColumnThreads, 0, context_.stream()>>>(n, slots(), b, product, candidate, x, direction,
                                                                   status());
  context_.launched("residuals");
}

}  // namespace touchfield::cuda
