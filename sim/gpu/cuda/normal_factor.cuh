#pragma once

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "sim/gpu/cuda/context.cuh"
#include "sim/gpu/cuda/launch.cuh"

// For .cu files only: products of a matrix, column by column with `ld` rows between columns, with `width` vectors one
// after another. Values are float, double, cuComplex or cuDoubleComplex; sums are always in the same order.

namespace touchfield::cuda {

constexpr unsigned kBlock = 256;  // threads where nothing speaks for another number
constexpr int kProductThreads = 1024;
constexpr int kProductRows = 8;  // of a block: so many lie side by side in memory

__device__ inline cuComplex operator+(cuComplex a, cuComplex b) { return cuCaddf(a, b); }
__device__ inline cuComplex operator*(cuComplex a, cuComplex b) { return cuCmulf(a, b); }
__device__ inline cuDoubleComplex operator+(cuDoubleComplex a, cuDoubleComplex b) { return cuCadd(a, b); }
__device__ inline cuDoubleComplex operator*(cuDoubleComplex a, cuDoubleComplex b) { return cuCmul(a, b); }

template <typename Value>
__global__ void __launch_bounds__(kProductThreads)
    multiply_rows(const Value* a, int ld, int rows, int columns, const Value* x, Value* product) {
  __shared__ Value sums[kProductThreads];
  const int thread = static_cast<int>(threadIdx.x);
  const int row = static_cast<int>(blockIdx.x) * kProductRows + thread % kProductRows;
  const Value* vector = x + std::size_t{1} * blockIdx.y * columns;
  Value sum{};
  if (row < rows) {
    for (int n = thread / kProductRows; n < columns; n += kProductThreads / kProductRows) {
      sum = sum + a[row + std::size_t{1} * n * ld] * vector[n];
    }
  }
  sums[thread] = sum;
  for (int half = kProductThreads / 2; half >= kProductRows; half /= 2) {
    __syncthreads();
    if (thread < half) {
      sums[thread] = sums[thread] + sums[thread + half];
    }
  }
  if (thread < kProductRows && row < rows) {
    product[std::size_t{1} * blockIdx.y * rows + row] = sums[thread];
  }
}

/// product = A x, A of `rows` > 0 rows.
template <typename Value>
void multiply(Context& context, const Value* a, int ld, int rows, int columns, const Value* x, Value* product,
              int width = 1) {
  launch(context, "product", multiply_rows<Value>, dim3(blocks_for(rows, kProductRows), width), kProductThreads, a, ld,
         rows, columns, x, product);
}

constexpr auto gemv(float /*value*/) { return cublasSgemv; }
constexpr auto gemv(double /*value*/) { return cublasDgemv; }
constexpr auto gemv(cuComplex /*value*/) { return cublasCgemv; }
constexpr auto gemv(cuDoubleComplex /*value*/) { return cublasZgemv; }

/// product = A^H x, A of `rows` > 0 rows.
template <typename Value>
void multiply_adjoint(Context& context, const Value* a, int ld, int rows, int columns, const Value* x, Value* product,
                      int width = 1) {
  const Value zero{};
  using Real = std::conditional_t<std::is_same_v<Value, float> || std::is_same_v<Value, cuComplex>, float, double>;
  const Real one[2] = {1, 0};  // real or complex
  for (std::size_t i = 0; i < static_cast<std::size_t>(width); ++i) {
    check(gemv(Value{})(context.blas(), CUBLAS_OP_C, rows, columns, reinterpret_cast<const Value*>(one), a, ld,
                        x + i * rows, 1, &zero, product + i * columns, 1),
          "product");
  }
}

/// One round trip: `in` values of the host to `input`, what `launch` makes of them in `output` to the host, `out` of
/// them.
template <typename Value, typename Number, class Launch>
void exchange(Context& context, const Number* from, std::size_t in, Array<Value>& input, Number* to, std::size_t out,
              Array<Value>& output, const Launch& launch) {
  static_assert(sizeof(Value) == sizeof(Number));
  context.use();
  auto* host = static_cast<Value*>(context.staging(sizeof(Value) * std::max(in, out)));
  std::memcpy(host, from, sizeof(Value) * in);
  input.upload(host, in);
  output.resize(out);
  launch();
  output.download(host, out);
  std::memcpy(static_cast<void*>(to), host, sizeof(Value) * out);
}

/// Solves F y = right, F = P + mu I, for many right-hand sides one after another: by a Cholesky factor F = L L^T in
/// single or double precision and corrections by the remainder in double. With L^-1 beside L a correction is products
/// alone, where substitution would wait for each entry.
class NormalFactor {
 public:
  explicit NormalFactor(Context& context) : context_(context) {}

  /// Makes room for the next P = J J^T, given by J (rows x columns), or P itself (rows x rows) where columns is 0. What
  /// is given is to be written to exact() and, unless in_double, rounded to rounded().
  void resize(int rows, int columns, bool in_double);
  double* exact() { return exact_.data(); }
  /// Null in double.
  float* rounded();

  /// returns   false where a pivot is not positive or not finite
  bool factorise(double mu);
  /// y += F^-1 (right - F y), where only F^-1 takes the factor, to which the remainder is handed in units of `unit`.
  ///
  /// right     rows, of the host, to begin with at y = 0; null to go on
  /// found     gets y (rows) or, where P is given by J, J^T y (columns), of the host
  /// returns   the norm of the remainder that is left
  double correct(const double* right, double unit, double* found);

 private:
  template <typename Real>
  bool factorise(double mu, const Real* given);
  template <typename Real>
  void invert();
  template <typename Real>
  void add_solution(double unit, bool first);

  Context& context_;
  int rows_ = 0;
  int columns_ = 0;
  bool in_double_ = false;
  double mu_ = 0;
  Array<double> exact_{context_};
  Array<float> rounded_{context_};
  // Of float or double, as the factor is.
  Array<double> factor_{context_};   // F, then L, in the lower triangle
  Array<double> inverse_{context_};  // L^-1, zeros above
  Array<double> between_{context_}, work_{context_}, scaled_{context_}, half_{context_};
  Array<int> info_{context_, 1};
  Array<double> right_{context_}, remainder_{context_};
  Array<double> product_{context_};  // P y
  Array<double> y_{context_};        // with room for the norm behind it, as in the next
  Array<double> inner_{context_};    // J^T y
};

}  // namespace touchfield::cuda
