#pragma once

#include <complex>
#include <cstddef>
#include <cuComplex.h>
#include <cublas_v2.h>
#include <cuda_runtime.h>
#include <cusolverDn.h>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sim/gpu/gpu.h"

namespace touchfield::cuda {

/// Throw GpuFailure, or GpuMemoryFailure, with what was being done.
void check(cudaError_t error, const char* what);
void check(cublasStatus_t status, const char* what);
void check(cusolverStatus_t status, const char* what);

/// What all work on one card shares. Everything runs in its one stream.
class Context final : public Gpu {
 public:
  Context(int index, const GpuLimits& limits);
  ~Context() override;

  const GpuInfo& info() const override { return info_; }
  std::size_t taken() const override { return taken_; }
  std::size_t most_taken() const override { return most_taken_; }
  std::size_t allowed() const override { return allowed_; }
  std::unique_ptr<GpuBody> body(const GpuBodySpec& spec) override;
  void field(const GpuBodySpec& body, const GpuSources& sources, const GpuField& field) override;
  std::unique_ptr<SkinDevice> skin(const GpuComplex* target, int faces, const GpuComplex* outside, int rank,
                                   int channels) override;

  /// Makes the card the thread's: at the head of whatever is called from outside.
  void use() const;
  cudaStream_t stream() const { return stream_; }
  cublasHandle_t blas() const { return blas_; }
  cusolverDnHandle_t solver() const { return solver_; }
  cusolverDnParams_t solver_params() const { return params_; }
  /// Compute capability 8.0 and later multiply in TF32.
  bool has_tf32() const { return info_.major >= 8; }

  /// After a kernel's launch: its error, if it has one, and the injected one.
  void launched(const char* what);
  /// Waits for everything.
  void synchronize();

  /// throws   GpuMemoryFailure beyond allowed()
  void* allocate(std::size_t bytes);
  void free(void* memory, std::size_t bytes) noexcept;
  /// Host memory that the card reads and writes directly, at least so large, for copies of small things; one piece, the
  /// next call may move it.
  void* staging(std::size_t bytes);

 private:
  void count_call();

  GpuInfo info_;
  std::size_t taken_ = 0;
  std::size_t most_taken_ = 0;
  std::size_t allowed_ = 0;
  int calls_left_ = -1;
  cudaStream_t stream_ = nullptr;
  cudaMemPool_t pool_ = nullptr;
  cublasHandle_t blas_ = nullptr;
  cusolverDnHandle_t solver_ = nullptr;
  cusolverDnParams_t params_ = nullptr;
  void* staging_ = nullptr;
  std::size_t staging_bytes_ = 0;
};

/// Memory on the card, of trivially copyable values; grows, never shrinks but by reset().
template <typename T>
class Array {
 public:
  explicit Array(Context& context) : context_(&context) {}
  Array(Context& context, std::size_t size) : context_(&context) { resize(size); }
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;
  Array(Array&& other) noexcept { swap(other); }
  Array& operator=(Array&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Array() { reset(); }

  void swap(Array& other) noexcept {
    std::swap(context_, other.context_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }

  /// What it held is lost where it grows.
  void resize(std::size_t size) {
    if (size > capacity_) {
      reset();
      data_ = static_cast<T*>(context_->allocate(size * sizeof(T)));
      capacity_ = size;
    }
    size_ = size;
  }
  void reset() noexcept {
    if (data_ != nullptr) {
      context_->free(data_, capacity_ * sizeof(T));
    }
    data_ = nullptr;
    size_ = 0;
    capacity_ = 0;
  }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }

  /// Copies begin when what was asked of the stream before is done; of host memory that is not staging() they end
  /// before the call does.
  void upload(const T* host, std::size_t count) {
    resize(count);
    check(cudaMemcpyAsync(data_, host, count * sizeof(T), cudaMemcpyHostToDevice, context_->stream()), "upload");
  }
  void upload(const std::vector<T>& host) { upload(host.data(), host.size()); }
  void download(T* host, std::size_t count) const {
    check(cudaMemcpyAsync(host, data_, count * sizeof(T), cudaMemcpyDeviceToHost, context_->stream()), "download");
    context_->synchronize();
  }
  T value(std::size_t i) const {
    auto* landed = static_cast<T*>(context_->staging(sizeof(T)));
    check(cudaMemcpyAsync(landed, data_ + i, sizeof(T), cudaMemcpyDeviceToHost, context_->stream()), "download");
    context_->synchronize();
    return *landed;
  }
  void set_zero() { check(cudaMemsetAsync(data_, 0, size_ * sizeof(T), context_->stream()), "set to zero"); }

 private:
  Context* context_ = nullptr;
  T* data_ = nullptr;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

inline unsigned blocks_for(std::size_t count, unsigned threads) {
  return static_cast<unsigned>((count + threads - 1) / threads);
}

}  // namespace touchfield::cuda
